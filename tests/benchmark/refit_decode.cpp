// Fits tuned constants of the decoder anew. `refit_decode --help` teaches its use.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "tests/benchmark/refit.h"

int main(int argc, char** argv) {
  CLI::App app(
      "Fits tuned constants of the decoder to takes of `weft simulate`, and prints them as they stand in the "
      "code, with how well they do on takes that were held out. The first and middle frame of each take "
      "count. Confidence depends a little on what the decoder had before: build and fit again until it "
      "prints what it was built with.",
      "refit_decode");
  app.require_subcommand(1);
  weft::testing::RefitTakes takes;
  double ridge = 10, crest_counts = 0.2;
  auto* confidence = app.add_subcommand("confidence", "Weights of pattern/surface/confidence.cpp");
  auto* sigma = app.add_subcommand("sigma", "kSigmaFactor of pattern/fit/cell_fitter.h");
  auto* rejection = app.add_subcommand("rejection", "kAbovePrediction of pattern/fit/cell_fitter.cpp");
  auto* observation = app.add_subcommand("observation", "Models of simulation/observation_model.cpp");
  for (auto* command : {confidence, sigma, rejection, observation}) {
    command->add_option("TAKE", takes.fitted, "Folders with pictures and truth")->required();
    command->add_option("--held-out", takes.held_out, "Folders that are only measured");
  }
  confidence->add_option("--ridge", ridge, "Precision of the prior on the weights")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  confidence
      ->add_option("--crest-counts", crest_counts, "How much a cell on the crest of a fold counts as wrong")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = *confidence    ? weft::testing::RefitConfidence(takes, ridge, crest_counts)
                              : *sigma       ? weft::testing::RefitSigma(takes)
                              : *observation ? weft::testing::RefitObservation(takes)
                                             : weft::testing::RefitRejection(takes);
  if (status.ok()) return 0;
  std::fprintf(stderr, "refit_decode: %s\n", std::string(status.message()).c_str());
  return 2;
}
