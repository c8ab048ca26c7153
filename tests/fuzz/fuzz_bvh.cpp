#include <utility>

#include "figure/retarget.h"
#include "services/formats/figure/bvh_file.h"
#include "tests/fuzz/fuzz_target.h"

// What is read is put on our skeleton.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto bvh = weft::ParseBvh({reinterpret_cast<const char*>(data), size}, "bvh");
  if (!bvh.ok()) return 0;
  const auto match = weft::MatchJoints(*bvh);
  if (!match.ok()) return 0;
  const auto motion = weft::Retarget(*bvh, *match);
  if (motion.ok()) weft::FuzzRequire(motion->motion.Validate().ok());
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  const std::string turn = "CHANNELS 3 Zrotation Xrotation Yrotation\n";
  std::string body =
      "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation "
      "Xrotation Yrotation\n";
  int joints = 1;
  for (const std::string side : {"Left", "Right"}) {
    const std::string x = side == "Left" ? "1" : "-1";
    for (const std::string chain : {"UpLeg Leg", "Arm ForeArm"}) {
      const size_t space = chain.find(' ');
      body += "JOINT " + side + chain.substr(0, space) + "\n{\nOFFSET " + x +
              (space == 5 ? " -1 0\n" : " 9 0\n") + turn;
      body += "JOINT " + side + chain.substr(space + 1) + "\n{\nOFFSET 0 -8 0\n" + turn;
      body += "End Site\n{\nOFFSET 0 -8 0\n}\n}\n}\n";
      joints += 2;
    }
  }
  body += "}\nMOTION\nFrames: 2\nFrame Time: 0.01\n";
  for (int frame = 0; frame < 2; ++frame)
    for (int k = 0; k < 3 * (joints + 1); ++k) body += k + 1 == 3 * (joints + 1) ? "5\n" : "5 ";
  // The spellings that readers take for each other.
  std::string other = body;
  for (const auto& [what, instead] :
       {std::pair<std::string, std::string>{"HIERARCHY", "\xef\xbb\xbfhierarchy"},
        {"JOINT LeftArm", "joint Bip01 L Arm"},
        {"End Site", "End Site Tip"},
        {"CHANNELS 3 Zrotation", "CHANNELS 6 Xposition Zscale Yposition Zrotation"},
        {"Frames: 2", "Frames:1"}})
    other.replace(other.find(what), what.size(), instead);
  return {body, other};
}
