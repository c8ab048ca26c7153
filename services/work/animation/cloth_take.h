// Complete meshes of a garment, frame by frame, wherever they lie: what avatars learn from and are measured
// against.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "figure/skeleton.h"
#include "services/formats/synthetic/frames_file.h"

namespace weft {

// Frames that follow each other. Movable; not for use by two threads at once.
class ClothTake {
 public:
  // frames.bin of `weft simulate --no-pictures`. Errors of FramesReader.
  static absl::StatusOr<ClothTake> OfFramesFile(std::string name, const std::string& path);
  // A mesh.ply for each frame. `names` of the frames, as many.
  static ClothTake OfMeshes(std::string name, std::vector<std::string> paths, std::vector<std::string> names,
                            double fps, std::string template_hash);

  // The same take with a reader of its own, for another thread.
  absl::StatusOr<ClothTake> OpenAgain() const;

  const std::string& name() const { return name_; }
  int frames() const { return frames_; }
  double fps() const { return fps_; }
  const std::string& template_hash() const { return template_hash_; }
  // Of meshes the names of the frames; empty for a frames file.
  const std::vector<std::string>& frame_names() const { return names_; }
  // XXH3-64 of the frames file in hexadecimal digits; empty for meshes.
  absl::StatusOr<std::string> FramesHash() const;

  // The pose of the wearer is there where the file has it. Errors name file and frame.
  absl::StatusOr<ClothFrame> Read(int frame);

  // Set by whoever opens the take.
  std::string split;   // of a data set; empty where it is of none
  std::string motion;  // takes of one kind of motion have the same: of a data set its motion, else the folder
  std::string folder;  // of the take: rig.json, board.json and template lie in it, or nothing does
  BodyShape body;      // of the wearer

 private:
  std::string name_, template_hash_, path_;
  std::vector<std::string> meshes_, names_;
  int frames_ = 0;
  double fps_ = 30;
  std::optional<FramesReader> reader_;
};

// What a folder holds: a data set of `weft dataset make` (its complete takes but for those of the split
// chaos), a take of `weft simulate` with or without pictures, or the results of `weft register` (runs of
// frames that follow each other; frames that failed or were bridged are left out).
struct ClothSource {
  std::vector<ClothTake> takes;
  std::string garment;  // folder of the template; empty where nothing tells it
  bool is_dataset = false;
};

// `fps` of meshes whose take tells no times; 0: 30. NotFound: nothing of the above, said with the remedy.
// FailedPrecondition: results that an avatar drove. Errors of the files.
absl::StatusOr<ClothSource> OpenClothSource(const std::string& folder, double fps);

// The template of the sources, and which folder it was read from: `given`, or where that is empty the first
// that a source tells. InvalidArgument where none does. FailedPrecondition, with both names and hashes, where
// a take has another one.
struct SharedTemplate {
  Template garment;
  std::string path;
};
absl::StatusOr<SharedTemplate> TemplateOfSources(const std::vector<ClothSource>& sources,
                                                 const std::string& given);

}  // namespace weft
