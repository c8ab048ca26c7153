#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "pattern/surface/confidence.h"
#include "pattern/view_decoder.h"
#include "tests/benchmark/decode_score.h"
#include "tests/benchmark/logistic_fit.h"
#include "tests/benchmark/refit.h"

namespace weft::testing {
namespace {

// A cell as the decoder scored it.
struct Candidate {
  Evidence evidence = {};
  bool has_evidence = false;
  bool is_there = false, on_crest = false;
  double counts = 0;                         // in a fit; 0 where it cannot be judged
  bool scoreable = false, in_sight = false;  // what recall counts; a part of the cell
  bool is_last = false;                      // of the last scoring of a view
  float pitch_px = 0;
  float confidence = 0;  // as the weights that are fitted have it
};

class Candidates {
 public:
  explicit Candidates(double crest_counts) : crest_counts_(crest_counts) {}

  absl::Status Add(const std::vector<std::string>& folders) {
    for (const std::string& folder : folders) {
      const absl::Status status = ForEachView(folder, [this](const NodesOfView& truth, ViewDecoder& decoder) {
        size_t last = all_.size();
        decoder.Decode([&](const BoardState& state) {
          last = all_.size();
          AddState(state, truth);
        });
        for (; last < all_.size(); ++last) all_[last].is_last = true;
      });
      if (!status.ok()) return status;
    }
    return absl::OkStatus();
  }

  LogisticModel Fit(double ridge) const {
    return FitLogistic(kReasons, ridge, [this](const auto& add) {
      for (const Candidate& c : all_) {
        if (c.counts > 0 && c.has_evidence) add(Regressors(c.evidence), c.is_there, c.counts);
      }
    });
  }
  void SetConfidence(const LogisticModel& model) {
    for (Candidate& c : all_) {
      c.confidence =
          c.has_evidence ? static_cast<float>(1 / (1 + std::exp(-model.LogOdds(Regressors(c.evidence))))) : 0;
    }
  }

  void PrintCalibration() const {
    constexpr std::array<float, 10> kEdges = {0,     0.5f,  0.8f,   0.9f,   0.95f,
                                              0.98f, 0.99f, 0.995f, 0.999f, 1.01f};
    std::printf("// %-18s %8s %9s %9s\n", "confidence", "n", "says", "is there");
    for (size_t k = 0; k + 1 < kEdges.size(); ++k) {
      double n = 0, says = 0, there = 0;
      for (const Candidate& c : all_) {
        if (c.confidence < kEdges[k] || c.confidence >= kEdges[k + 1]) continue;
        n += c.counts;
        says += c.counts * c.confidence;
        there += c.counts * c.is_there;
      }
      if (n > 0)
        std::printf("// %.3f to %.3f     %8.0f %9.5f %9.5f\n", kEdges[k], std::min(kEdges[k + 1], 1.0f), n,
                    says / n, there / n);
    }
  }

  // What is left of the last scoring.
  void PrintLimits() const {
    std::printf("// %-10s %12s %8s %8s %12s %12s %8s\n", "least", "scoreable", "cells", "wrong",
                "3 px or more", "out of sight", "on crest");
    for (const float least :
         {0.0f, 0.85f, 0.92f, 0.95f, 0.96f, 0.97f, 0.975f, 0.98f, 0.985f, 0.99f, 0.995f}) {
      size_t scoreable = 0, cells = 0, wrong = 0, large = 0, hidden = 0, on_crest = 0;
      for (const Candidate& c : all_) {
        if (!(c.counts > 0) || !c.is_last || c.confidence < least) continue;
        ++cells;
        scoreable += c.scoreable && c.is_there;
        on_crest += c.on_crest;
        if (c.is_there || c.on_crest) continue;
        ++wrong;
        large += c.pitch_px >= 3;
        hidden += !c.in_sight;
      }
      std::printf("// %-10.3f %12zu %8zu %8zu %12zu %12zu %8zu\n", least, scoreable, cells, wrong, large,
                  hidden, on_crest);
    }
  }

 private:
  void AddState(const BoardState& state, const NodesOfView& truth) {
    for (const ViewCell& cell : state.cells()) {
      Candidate c;
      if (const auto evidence = EvidenceFor(state, cell)) {
        c.evidence = *evidence;
        c.has_evidence = true;
      }
      const BoardNode node{cell.row, cell.col, NodeKind::kCenter};
      const Verdict verdict = truth.Assess(node, cell.fit.pose.x, cell.fit.pose.y);
      c.is_there = verdict == Verdict::kRight;
      c.on_crest = verdict == Verdict::kOnCrest;
      // What was read stays, whatever this evidence says.
      c.counts = verdict == Verdict::kUnjudged || cell.is_read ? 0 : c.on_crest ? crest_counts_ : 1;
      if (const NodeTruth* at = truth.Find(node)) {
        c.in_sight = true;
        c.scoreable = at->scoreable;
        c.pitch_px = static_cast<float>(at->pitch_px);
      }
      all_.push_back(c);
    }
  }

  static Eigen::VectorXd Regressors(const Evidence& evidence) {
    return Eigen::Map<const Eigen::Vector<float, kReasons>>(evidence.data()).cast<double>();
  }

  double crest_counts_;
  std::vector<Candidate> all_;
};

void Print(const LogisticModel& model) {
  std::printf("constexpr float kConstant = %.2ff;\nconstexpr Evidence kWeights = {", model.constant);
  for (int k = 0; k < kReasons; ++k) {
    const char* end = k + 1 == kReasons ? "};\n" : k % 8 == 7 ? ",\n                               " : ", ";
    std::printf("%.2ff%s", model.weights[k], end);
  }
}

}  // namespace

absl::Status RefitConfidence(const RefitTakes& takes, double ridge, double crest_counts) {
  LogisticModel model;
  {
    Candidates fitted(crest_counts);
    if (absl::Status status = fitted.Add(takes.fitted); !status.ok()) return status;
    model = fitted.Fit(ridge);
    Print(model);
    fitted.SetConfidence(model);
    std::printf("\n// fitted\n");
    fitted.PrintCalibration();
    fitted.PrintLimits();
  }
  if (takes.held_out.empty()) return absl::OkStatus();
  Candidates held_out(crest_counts);
  if (absl::Status status = held_out.Add(takes.held_out); !status.ok()) return status;
  held_out.SetConfidence(model);
  std::printf("\n// held out\n");
  held_out.PrintCalibration();
  held_out.PrintLimits();
  return absl::OkStatus();
}

}  // namespace weft::testing
