// What filming several garments together costs each of them: recall of cells and errors of vertices in the
// film of all, beside films of one each that show the same motion; cells that were given to another garment;
// and places where the meshes of different garments meet. Usage (docs/decoding-accuracy.md has the commands
// that make the films):
//   accuracy_outfit --joint TAKE RESULT --alone TAKE RESULT [--alone TAKE RESULT]...
// Takes are those of `weft simulate`, once with all garments and once with `--show NAME` each; results are
// those of `weft register TAKE --template TAKE/template --observations`.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "CLI/CLI.hpp"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "alignment/untangle/self_intersection.h"
#include "base/median.h"
#include "evaluation/truth_score.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/frame_folders.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/observations_file.h"
#include "services/formats/files/template_file.h"
#include "services/formats/synthetic/truth_file.h"

namespace weft {
namespace {

// A take with the result of its registration.
struct Film {
  std::string take, result;
  Template garments;
  Board board;

  std::string TruthOf(const std::string& frame) const { return absl::StrCat(take, "/truth/", frame); }
  std::string ResultOf(const std::string& frame) const { return absl::StrCat(result, "/", frame); }
};

absl::StatusOr<Film> Open(const std::string& take, const std::string& result) {
  Film film{take, result, {}, {}};
  auto board = ReadBoard(film.take + "/board.json");
  if (!board.ok()) return board.status();
  film.board = *std::move(board);
  auto garments = ReadTemplate(film.take + "/template");
  if (!garments.ok()) return garments.status();
  film.garments = *std::move(garments);
  if (film.garments.garments.size() > 1) return film;
  return absl::InvalidArgumentError(film.take + "/template: is of one garment, not of several");
}

// A frame of a film: what is true of it, and what was made of it.
struct FilmFrame {
  FrameTruth truth;
  std::vector<ImageObservations> observations;
  RegisteredMesh mesh;
};

absl::StatusOr<FilmFrame> ReadFrame(const Film& film, const std::string& name) {
  auto truth = ReadFrameTruth(film.TruthOf(name));
  if (!truth.ok()) return truth.status();
  auto observations = ReadObservations(film.ResultOf(name) + "/observations.csv");
  if (!observations.ok()) return observations.status();
  auto mesh = ReadRegisteredMesh(film.ResultOf(name) + "/mesh.ply");
  if (!mesh.ok()) return mesh.status();
  if (mesh->vertices_mm.size() == truth->mesh.vertices_mm.size() &&
      mesh->vertices_mm.size() == film.garments.rest.vertices_mm.size())
    return FilmFrame{*std::move(truth), *std::move(observations), *std::move(mesh)};
  return absl::InvalidArgumentError(
      absl::StrCat(film.ResultOf(name), "/mesh.ply: its vertices are not those of ", film.take, "/template"));
}

// Which garment's part of the joint board a node lies on; -1 for none.
class GarmentOfNode {
 public:
  explicit GarmentOfNode(const Film& film)
      : board_(film.board), garment_of_part_(film.board.parts.size(), -1) {
    for (size_t g = 0; g < film.garments.garments.size(); ++g) {
      const GarmentSpan& garment = film.garments.garments[g];
      for (int v = garment.first_vertex; v < garment.first_vertex + garment.vertices; ++v) {
        const VertexNode& node = film.garments.node_of_vertex[v];
        const int part = node.row < 0 ? -1 : board_.PartAt(node.row);
        if (part >= 0) garment_of_part_[part] = static_cast<int>(g);
      }
    }
  }

  int operator()(const BoardNode& node) const {
    const int part = board_.PartAt(node.row);
    return part < 0 ? -1 : garment_of_part_[part];
  }

 private:
  const Board& board_;
  std::vector<int> garment_of_part_;
};

// The centres of a view: what is true, and whether each was observed where it is.
struct SeenView {
  std::map<BoardNode, const NodeTruth*> nodes;
  std::map<BoardNode, bool> is_right;  // of the observed ones
  std::vector<Observation> wrong;
};

SeenView LookAt(const FilmFrame& frame, const ViewTruth& truth) {
  SeenView view;
  for (const NodeTruth& node : truth.nodes) {
    if (node.node.kind == NodeKind::kCenter) view.nodes[node.node] = &node;
  }
  for (const ImageObservations& image : frame.observations) {
    if (image.image != truth.camera_id) continue;
    for (const Observation& o : image.observations) {
      if (o.node.kind != NodeKind::kCenter) continue;
      const auto at = view.nodes.find(o.node);
      const bool right =
          at != view.nodes.end() && (at->second->pixel_px - Eigen::Vector2d(o.x_px, o.y_px)).norm() <
                                        EvaluationOptions().right_within_pitch * at->second->pitch_px;
      view.is_right[o.node] |= right;
      if (!right) view.wrong.push_back(o);
    }
  }
  return view;
}

// Of a garment, over all frames.
struct GarmentTally {
  int64_t cells = 0, found_jointly = 0, found_alone = 0;  // cells scoreable in both films
  int64_t given_away = 0;  // places of its cells that were read as another garment's in the joint film
  int64_t foreign = 0;     // cells of other garments that were read in the film of this one alone
  int64_t observed = 0;    // cells of its own, in the joint film
  std::vector<double> joint_mm, alone_mm;  // errors of vertices that are well seen in both films
  bool is_filmed_alone = false;
};

class OutfitScore {
 public:
  explicit OutfitScore(const Film& joint)
      : joint_(joint.garments), garment_of_(joint), tallies_(joint_.garments.size()) {}

  void AddJoint(const FilmFrame& frame) {
    for (const ViewTruth& truth : frame.truth.views) {
      const SeenView view = LookAt(frame, truth);
      for (const auto& [node, right] : view.is_right) {
        if (const int garment = garment_of_(node); garment >= 0 && right) ++tallies_[garment].observed;
      }
      for (const Observation& o : view.wrong) {
        const int here = GarmentAt(view, o);
        if (here < 0 || here == garment_of_(o.node)) continue;
        ++tallies_[here].given_away;
        std::fprintf(stderr, "%s, %.1f %.1f: a cell of %s was read as %d/%d\n", truth.camera_id.c_str(),
                     o.x_px, o.y_px, joint_.garments[here].id.c_str(), o.node.row, o.node.col);
      }
    }
    for (const FacePair& pair : FindSelfIntersections(frame.mesh.vertices_mm, frame.truth.mesh.faces))
      pairs_ += 1, pairs_between_ += GarmentOfFace(pair.a) != GarmentOfFace(pair.b);
    ++frames_;
  }

  // InvalidArgument: the film alone shows no garment, or more than one.
  absl::Status AddAlone(const FilmFrame& joint, const FilmFrame& alone, const std::string& name) {
    std::vector<int64_t> shown(tallies_.size());
    for (const ViewTruth& truth : alone.truth.views) {
      for (const NodeTruth& node : truth.nodes) {
        if (const int garment = garment_of_(node.node); garment >= 0) shown[garment] += node.visible;
      }
    }
    if (std::count(shown.begin(), shown.end(), 0) != static_cast<int64_t>(shown.size()) - 1)
      return absl::InvalidArgumentError(name + ": does not show one garment alone");
    const auto garment = static_cast<size_t>(std::max_element(shown.begin(), shown.end()) - shown.begin());
    GarmentTally& tally = tallies_[garment];
    tally.is_filmed_alone = true;
    AddCells(joint, alone, static_cast<int>(garment), &tally);
    AddVertices(joint, alone, joint_.garments[garment], &tally);
    return absl::OkStatus();
  }

  void Print() const {
    std::printf("%-8s %9s %7s %7s %7s   %9s %7s %7s   %8s %15s %15s %15s\n", "", "cells", "recall", "",
                "points", "cells", "given", "foreign", "vertices", "median mm", "mean mm", "95 % mm");
    std::printf("%-8s %9s %7s %7s %7s   %9s %7s %7s   %8s %15s %15s %15s\n", "garment", "in both", "jointly",
                "alone", "lost", "observed", "away", "", "in both", "jointly / alone", "jointly / alone",
                "jointly / alone");
    for (size_t g = 0; g < tallies_.size(); ++g) {
      const GarmentTally& t = tallies_[g];
      if (!t.is_filmed_alone) continue;
      const auto share = [&](int64_t n) {
        return 100.0 * static_cast<double>(n) / static_cast<double>(std::max<int64_t>(t.cells, 1));
      };
      std::printf("%-8s %9lld %7.2f %7.2f %7.2f   %9lld %7lld %7lld   %8zu", joint_.garments[g].id.c_str(),
                  static_cast<long long>(t.cells), share(t.found_jointly), share(t.found_alone),
                  share(t.found_alone) - share(t.found_jointly), static_cast<long long>(t.observed),
                  static_cast<long long>(t.given_away), static_cast<long long>(t.foreign), t.joint_mm.size());
      PrintRatio(Quantile(t.joint_mm, 0.5), Quantile(t.alone_mm, 0.5));
      PrintRatio(Mean(t.joint_mm), Mean(t.alone_mm));
      PrintRatio(Quantile(t.joint_mm, 0.95), Quantile(t.alone_mm, 0.95));
      std::printf("\n");
    }
    std::printf("%d frames: %lld pairs of faces intersect between garments, %lld in all\n", frames_,
                static_cast<long long>(pairs_between_), static_cast<long long>(pairs_));
  }

 private:
  static double Mean(const std::vector<double>& values) {
    double sum = 0;
    for (const double v : values) sum += v;
    return sum / static_cast<double>(std::max<size_t>(values.size(), 1));
  }

  static void PrintRatio(double jointly, double alone) {
    std::printf(" %6.4f x %6.3f", jointly, jointly / alone);
  }

  int GarmentOfFace(int face) const {
    for (size_t g = 0; g < joint_.garments.size(); ++g) {
      const GarmentSpan& garment = joint_.garments[g];
      if (face >= garment.first_face && face < garment.first_face + garment.faces) return static_cast<int>(g);
    }
    return -1;
  }

  // Of the visible cell at an observation's place; -1 where there is none.
  int GarmentAt(const SeenView& view, const Observation& o) const {
    for (const auto& [node, truth] : view.nodes) {
      if (truth->visible && (truth->pixel_px - Eigen::Vector2d(o.x_px, o.y_px)).norm() <
                                EvaluationOptions().right_within_pitch * truth->pitch_px)
        return garment_of_(node);
    }
    return -1;
  }

  void AddCells(const FilmFrame& joint, const FilmFrame& alone, int garment, GarmentTally* tally) const {
    for (size_t v = 0; v < joint.truth.views.size() && v < alone.truth.views.size(); ++v) {
      const SeenView a = LookAt(joint, joint.truth.views[v]), b = LookAt(alone, alone.truth.views[v]);
      const auto found = [](const SeenView& view, const BoardNode& node) {
        const auto at = view.is_right.find(node);
        return at != view.is_right.end() && at->second;
      };
      for (const auto& [node, right] : b.is_right) tally->foreign += garment_of_(node) != garment;
      for (const auto& [node, truth] : a.nodes) {
        const auto other = b.nodes.find(node);
        if (garment_of_(node) != garment || !truth->scoreable || other == b.nodes.end() ||
            !other->second->scoreable)
          continue;
        ++tally->cells;
        tally->found_jointly += found(a, node);
        tally->found_alone += found(b, node);
      }
    }
  }

  static void AddVertices(const FilmFrame& joint, const FilmFrame& alone, const GarmentSpan& garment,
                          GarmentTally* tally) {
    const std::vector<bool> a = WellSeenVertices(joint.truth, nullptr),
                            b = WellSeenVertices(alone.truth, nullptr);
    for (int v = garment.first_vertex; v < garment.first_vertex + garment.vertices; ++v) {
      if (!a[v] || !b[v]) continue;
      const auto error_mm = [&](const FilmFrame& frame) {
        return (frame.mesh.vertices_mm[v] - frame.truth.mesh.vertices_mm[v]).norm();
      };
      tally->joint_mm.push_back(error_mm(joint));
      tally->alone_mm.push_back(error_mm(alone));
    }
  }

  const Template& joint_;
  GarmentOfNode garment_of_;
  std::vector<GarmentTally> tallies_;
  int64_t pairs_ = 0, pairs_between_ = 0;
  int frames_ = 0;
};

// A take and a result each.
absl::Status Run(const std::vector<std::string>& joint_folders,
                 const std::vector<std::string>& alone_folders) {
  const auto joint = Open(joint_folders[0], joint_folders[1]);
  if (!joint.ok()) return joint.status();
  std::vector<Film> films;
  for (size_t k = 0; k + 1 < alone_folders.size(); k += 2) {
    auto film = Open(alone_folders[k], alone_folders[k + 1]);
    if (!film.ok()) return film.status();
    films.push_back(*std::move(film));
  }
  const auto frames = ListFrameFolders(joint->result);
  if (!frames.ok()) return frames.status();
  OutfitScore score(*joint);
  for (const std::string& name : *frames) {
    const auto together = ReadFrame(*joint, name);
    if (!together.ok()) return together.status();
    score.AddJoint(*together);
    for (const Film& film : films) {
      const auto alone = ReadFrame(film, name);
      if (!alone.ok()) return alone.status();
      if (absl::Status status = score.AddAlone(*together, *alone, film.take); !status.ok()) return status;
    }
    std::fprintf(stderr, "\r%s", name.c_str());
  }
  std::fprintf(stderr, "\r");
  score.Print();
  return absl::OkStatus();
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) {
  CLI::App app{"What filming several garments together costs each of them"};
  std::vector<std::string> joint, alone;
  app.add_option("--joint", joint, "Take and result of all garments")->expected(2)->required();
  app.add_option("--alone", alone, "Take and result of one garment, again for each")
      ->type_size(2)
      ->expected(1, 100)
      ->required();
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = weft::Run(joint, alone);
  if (status.ok()) return 0;
  std::fprintf(stderr, "accuracy_outfit: %s\n", std::string(status.message()).c_str());
  return 2;
}
