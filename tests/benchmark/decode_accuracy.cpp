// How right decoding is, and whether it knows: errors against sigma_px by class, and confidence against the
// share that is right. Usage: accuracy_decode [TAKE...] with folders that `weft simulate` wrote; without any,
// a small take is made here. The first and middle frame of each are judged.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "capture/image_file.h"
#include "pattern/decoder.h"
#include "services/files/board_file.h"
#include "services/synthetic/truth_file.h"
#include "simulation/take_presets.h"

namespace weft {
namespace {

// An observation with what is true of it.
struct Judged {
  NodeKind kind;
  bool right;  // the node is there, within half a pitch
  double error_px, pitch_px;
  float sigma_px, confidence;
  int neighbors;  // of the 8 around it, observed
};

struct Judgement {
  std::vector<Judged> judged;
  size_t scoreable = 0, found = 0;  // cells
};

using NodeKey = std::tuple<NodeKind, int, int>;
NodeKey KeyOf(const BoardNode& node) { return {node.kind, node.row, node.col}; }

void Judge(const DecodeResult& result, const ViewTruth& truth, Judgement& judgement) {
  std::map<NodeKey, const NodeTruth*> is_there;
  for (const NodeTruth& node : truth.nodes) is_there[KeyOf(node.node)] = &node;
  std::map<NodeKey, bool> observed;
  for (const Observation& o : result.observations) observed[KeyOf(o.node)] = true;
  for (const Observation& o : result.observations) {
    const auto at = is_there.find(KeyOf(o.node));
    Judged j{o.node.kind, false, 0, 0, o.sigma_px, o.confidence, 0};
    for (int k = 0; k < 9; ++k) {
      if (k != 4)
        j.neighbors += observed.contains({o.node.kind, o.node.row + k / 3 - 1, o.node.col + k % 3 - 1});
    }
    if (at != is_there.end()) {
      j.pitch_px = at->second->pitch_px;
      j.error_px = std::hypot(o.x_px - at->second->pixel_px.x(), o.y_px - at->second->pixel_px.y());
      j.right = j.error_px < 0.5 * j.pitch_px;
    }
    judgement.judged.push_back(j);
  }
  for (const NodeTruth& node : truth.nodes) {
    if (!node.scoreable || node.node.kind != NodeKind::kCenter) continue;
    ++judgement.scoreable;
    judgement.found += observed.contains(KeyOf(node.node));
  }
}

bool JudgeTake(const std::string& folder, Judgement& judgement) {
  const auto board = ReadBoard(folder + "/board.json");
  const auto frames = ListTruthFrames(folder + "/truth");
  if (!board.ok() || !frames.ok()) {
    std::fprintf(stderr, "%s: no take with truth\n", folder.c_str());
    return false;
  }
  const BoardIndex index = *BoardIndex::Build(*board);
  for (const size_t f : {size_t{0}, frames->size() / 2}) {
    const auto truth = ReadFrameTruth(folder + "/truth/" + (*frames)[f]);
    if (!truth.ok()) continue;
    for (const ViewTruth& view : truth->views) {
      const auto image = ReadImageFile(folder + "/" + (*frames)[f] + "/" + view.camera_id + ".png");
      if (!image.ok()) continue;
      const auto result = DecodeView(*image, index, {});
      if (result.ok()) Judge(*result, view, judgement);
    }
  }
  return true;
}

void JudgeSmallTake(Judgement& judgement) {
  SyntheticTakeOptions options = *SyntheticPreset("quickstart", 1);
  options.performance.frames = 1;
  SyntheticTake take = *SyntheticTake::Make(options);
  const TakeFrame frame = *take.Next();
  const BoardIndex index = *BoardIndex::Build(take.board());
  for (int camera = 0; camera < static_cast<int>(take.rig().cameras.size()); camera += 4) {
    const FilmedView view = *take.Film(frame, camera);
    const Frame image = ToFrame(*view.picture);
    Judge(*DecodeView(image, index, {}), view.truth, judgement);
  }
}

double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

void PrintClass(const char* name, const std::vector<Judged>& all,
                const std::function<bool(const Judged&)>& in) {
  std::vector<double> errors, ratios;
  double squares = 0;
  for (const Judged& j : all) {
    if (!j.right || !in(j)) continue;
    errors.push_back(j.error_px);
    ratios.push_back(j.error_px / j.sigma_px);
    squares += ratios.back() * ratios.back();
  }
  const double rms = std::sqrt(squares / static_cast<double>(std::max<size_t>(ratios.size(), 1)));
  std::printf("%-22s %8zu  %6.3f %6.3f   %6.2f %6.2f %6.2f %6.2f\n", name, errors.size(),
              Quantile(errors, 0.5), Quantile(errors, 0.95), rms, Quantile(ratios, 0.5),
              Quantile(ratios, 0.95), Quantile(ratios, 0.99));
}

void PrintErrors(const std::vector<Judged>& all) {
  std::printf("%-22s %8s  %13s   %27s\n", "", "", "error px", "error / sigma_px");
  std::printf("%-22s %8s  %6s %6s   %6s %6s %6s %6s\n", "class", "n", "50 %", "95 %", "rms", "50 %", "95 %",
              "99 %");
  // Of two axes that each err by sigma.
  std::printf("%-22s %8s  %6s %6s   %6.2f %6.2f %6.2f %6.2f\n", "(as sigma_px says)", "", "", "", 1.41, 1.18,
              2.45, 3.03);
  const auto cell = [](const Judged& j) { return j.kind == NodeKind::kCenter; };
  PrintClass("cells", all, cell);
  PrintClass("  inside, 8 around", all, [&](const Judged& j) { return cell(j) && j.neighbors == 8; });
  PrintClass("  border, 5 to 7", all,
             [&](const Judged& j) { return cell(j) && j.neighbors >= 5 && j.neighbors < 8; });
  PrintClass("  border, 0 to 4", all, [&](const Judged& j) { return cell(j) && j.neighbors < 5; });
  constexpr std::array<double, 6> kPitches = {0, 4, 5, 7, 10, 1e9};
  for (size_t k = 0; k + 1 < kPitches.size(); ++k) {
    const std::string name =
        kPitches[k + 1] > 1e6 ? "  pitch above 10 px"
                              : "  pitch below " + std::to_string(static_cast<int>(kPitches[k + 1])) + " px";
    PrintClass(name.c_str(), all, [&](const Judged& j) {
      return cell(j) && j.pitch_px >= kPitches[k] && j.pitch_px < kPitches[k + 1];
    });
  }
  PrintClass("corners", all, [&](const Judged& j) { return !cell(j); });
}

void PrintReliability(const std::vector<Judged>& all) {
  constexpr std::array<float, 8> kEdges = {0, 0.95f, 0.98f, 0.99f, 0.995f, 0.998f, 0.9995f, 1.01f};
  std::printf("\n%-22s %8s  %9s %9s\n", "confidence", "n", "says", "is right");
  for (size_t k = 0; k + 1 < kEdges.size(); ++k) {
    double says = 0;
    size_t n = 0, right = 0;
    for (const Judged& j : all) {
      if (j.kind != NodeKind::kCenter || j.confidence < kEdges[k] || j.confidence >= kEdges[k + 1]) continue;
      ++n;
      right += j.right;
      says += j.confidence;
    }
    if (n == 0) continue;
    std::printf("%.4f to %.4f       %8zu  %9.5f %9.5f\n", kEdges[k], std::min(kEdges[k + 1], 1.0f), n,
                says / static_cast<double>(n), static_cast<double>(right) / static_cast<double>(n));
  }
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) {
  weft::Judgement judgement;
  for (int k = 1; k < argc; ++k) {
    if (!weft::JudgeTake(argv[k], judgement)) return 2;
  }
  if (argc < 2) weft::JudgeSmallTake(judgement);
  const double scoreable = static_cast<double>(std::max<size_t>(judgement.scoreable, 1));
  std::printf("recall of %zu scoreable cells: %.4f\n\n", judgement.scoreable,
              static_cast<double>(judgement.found) / scoreable);
  weft::PrintErrors(judgement.judged);
  weft::PrintReliability(judgement.judged);
}
