#include "services/results/report/picture_data.h"

namespace weft {
namespace {

const char* MeaningOf(VertexState state) {
  switch (state) {
    case VertexState::kObserved:
      return "observed: measured in this frame";
    case VertexState::kTwoView:
      return "measured by two cameras only";
    case VertexState::kBridged:
      return "bridged: from the frames around";
    case VertexState::kDriven:
      return "driven: by the garment's avatar and at most one camera";
    case VertexState::kInferred:
      break;
  }
  return "inferred from the cloth around it";
}

}  // namespace

v1::PagePicture PictureData(const MeshPicture& picture) {
  v1::PagePicture data;
  data.set_title(picture.title);
  data.set_bytes(picture.bytes);
  data.set_type(picture.type);
  data.set_width_px(picture.width_px);
  data.set_height_px(picture.height_px);
  return data;
}

void AddPictures(const std::vector<MeshPicture>& pictures,
                 google::protobuf::RepeatedPtrField<v1::PagePicture>& data) {
  for (const MeshPicture& picture : pictures) *data.Add() = PictureData(picture);
}

std::vector<std::string> ScaleColors(const ScalarRange& range) {
  constexpr int kStops = 16;
  std::vector<std::string> colors;
  for (int i = 0; i <= kStops; ++i)
    colors.push_back(HexColor(ScalarColor(range.low + (range.high - range.low) * i / kStops, range)));
  return colors;
}

v1::PageKey ScaleKey(const ScalarRange& range, const std::string& label, const std::string& unit,
                     bool bounded) {
  v1::PageKey key;
  v1::PageScale& scale = *key.mutable_scale();
  scale.set_low(range.low);
  scale.set_high(range.high);
  scale.set_label(label);
  scale.set_unit(unit);
  scale.set_bounded(bounded);
  for (const std::string& color : ScaleColors(range)) scale.add_colors(color);
  return key;
}

v1::PageKey StateKey(const std::vector<VertexState>& states) {
  v1::PageKey key;
  for (const VertexState state : states) {
    v1::PageKey::Entry& entry = *key.add_entries();
    entry.set_color(HexColor(StateColor(state)));
    entry.set_meaning(MeaningOf(state));
  }
  return key;
}

}  // namespace weft
