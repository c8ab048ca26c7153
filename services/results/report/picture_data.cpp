#include "services/results/report/picture_data.h"

#include <algorithm>

#include "base/status_macros.h"
#include "services/results/report/frame_pictures.h"

namespace weft {
namespace {

constexpr int kScaleStops = 16;

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

v1::PageKey ScaleKey(const ScalarRange& range, const std::string& label, const std::string& unit,
                     bool bounded) {
  v1::PageKey key;
  v1::PageScale& scale = *key.mutable_scale();
  scale.set_low(range.low);
  scale.set_high(range.high);
  scale.set_label(label);
  scale.set_unit(unit);
  scale.set_bounded(bounded);
  for (int i = 0; i <= kScaleStops; ++i)
    scale.add_colors(HexColor(ScalarColor(range.low + (range.high - range.low) * i / kScaleStops, range)));
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

absl::StatusOr<v1::PageMap> GarmentMapData(const TriangleMesh& mesh, const GarmentMap& map) {
  // The middle of a diverging scale is nearly white; in deep shadow it would look like what has no value.
  const bool is_around_zero = map.range.low < 0;
  WEFT_ASSIGN_OR_RETURN(
      const std::vector<MeshPicture> pictures,
      DrawBothSides(mesh, ScalarColors(map.values, map.range), is_around_zero ? 0.25 : 0.6));
  const bool is_bounded = std::ranges::none_of(map.values, [&](double value) {
    return value > map.range.high || (is_around_zero && value < map.range.low);
  });
  v1::PageMap data;
  data.set_title(map.title);
  AddPictures(pictures, *data.mutable_pictures());
  *data.mutable_key() = ScaleKey(map.range, map.label, map.unit, is_bounded);
  return data;
}

}  // namespace weft
