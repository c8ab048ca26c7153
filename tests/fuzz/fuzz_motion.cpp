#include "figure/motion_generator.h"
#include "services/formats/figure/body_file.h"
#include "services/formats/figure/motion_file.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto body = weft::ParseBody(bytes, "body");
  if (body.ok()) weft::FuzzRequire(body->shape.Validate().ok());
  const auto motion = weft::DecodeMotion(bytes, "motion");
  if (!motion.ok()) return 0;
  weft::FuzzRequire(motion->Validate().ok());
  weft::FuzzRequire(motion->PoseAt(0.1).root_mm.allFinite());
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  return {EncodeMotion(*MakeMotion({MotionKind::kWalk, 0.1, 30, 1})),
          EncodeMotion(*MakeMotion({MotionKind::kSpline, 0.05, 24, 2})),
          R"({"id": "anna", "stature": 0.93, "waist_girth": 1.1, "belly_depth": 1.2})"};
}
