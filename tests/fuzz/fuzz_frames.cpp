#include "services/formats/synthetic/dataset_file.h"
#include "services/formats/synthetic/frames_file.h"
#include "tests/fuzz/fuzz_target.h"

// A data set's record, or a head and as much of a frame as there is.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto dataset = weft::ParseDataset(bytes, "dataset");
  if (dataset.ok())
    for (const weft::v1::DatasetTake& take : dataset->takes())
      weft::FuzzRequire(take.name().find_first_of("/.") == std::string::npos);
  const auto head = weft::DecodeFramesHead(bytes, "frames");
  if (!head.ok()) return 0;
  weft::FuzzRequire(weft::EncodeFramesHead(*head) == bytes.substr(0, weft::FramesHeadBytes(*head)));
  const auto frame = weft::DecodeClothFrame(*head, bytes.substr(weft::FramesHeadBytes(*head)), "frames");
  weft::FuzzRequire(!frame.ok() || frame->vertices_mm.size() == head->vertices);
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  const FramesHead head = {"hash", 2, 30, true}, plain = {"", 1, 60, false};
  ClothFrame frame;
  frame.vertices_mm = {{1, 2, 3}, {4, 5, 6}};
  frame.pose.emplace();
  return {EncodeFramesHead(head) + EncodeClothFrame(head, frame),
          EncodeFramesHead(plain) + EncodeClothFrame(plain, {0, {{7, 8, 9}}, {}}),
          R"({"name": "x", "takes": [{"name": "train-walk-1", "split": "train", "motion": "walk",
"motion_seed": "1", "frames": 9}]})"};
}
