// Calibrates simulated rigs from projected corners and compares with the rig that made them:
//   accuracy_calibration [CAMERAS FRAMES NOISE_PX LONGEST_LENS [SEED]]
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "tests/capture/calibration/simulated_calibration.h"

namespace weft {
namespace {

void Judge(int cameras, int frames, double noise_px, double longest, uint64_t seed) {
  const SimulatedCalibration truth = Simulate(cameras, frames, noise_px, longest, {}, seed);
  size_t corners = 0;
  for (const BoardView& view : truth.views.boards) corners += view.corners.size();
  std::printf("%d cameras, %d frames, %zu views, %zu corners, noise %.3f px\n", cameras, frames,
              truth.views.boards.size(), corners, noise_px);
  const std::clock_t start = std::clock();
  std::string last;
  const auto solved = SolveCalibration(
      truth.moved.target, truth.views, std::nullopt, {}, [&](const std::string& stage, double) {
        if (stage != last)
          std::fprintf(stderr, "  %s at %.1f s\n", stage.c_str(),
                       static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
        last = stage;
      });
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  if (!solved.ok()) {
    std::printf("  %s\n", solved.status().ToString().c_str());
    return;
  }
  const ErrorsAndSigmas compared = Compare(*solved, truth);
  double lens = 0, pose = 0, worst = 0, center_mm = 0, projection_px = 0;
  for (int c = 0; c < cameras; ++c) {
    lens += compared.ChiSquareOf(15 * c, 9) / 9 / cameras;
    pose += compared.ChiSquareOf(15 * c + 9, 6) / 6 / cameras;
    worst = std::max(worst, compared.ChiSquareOf(15 * c, 15));
    center_mm += compared.errors.segment<3>(15 * c + 12).squaredNorm() / cameras;
    projection_px = std::max(projection_px, solved->cameras[c].projection_sigma_px);
  }
  std::printf("  %.1f s of processor time, %d iterations%s\n", seconds, solved->iterations,
              solved->converged ? "" : ", not converged");
  std::printf("  residuals %.4f px, variance factor %.4f\n", solved->rms_px, solved->variance_factor);
  std::printf(
      "  chi-square per freedom: all together %.3f (%.1f sigmas off), lenses %.2f, poses %.2f, worst camera "
      "%.1f of 15\n",
      compared.per_freedom(), compared.sigmas_off(), lens, pose, worst);
  std::printf("  likelihood ratio of the true rig per freedom: %.3f\n",
              LikelihoodRatio(*solved, truth) / compared.freedom);
  std::printf("  centres %.3f mm rms, worst stage sigma %.3f px\n", std::sqrt(center_mm), projection_px);
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) {
  if (argc >= 5) {
    weft::Judge(std::atoi(argv[1]), std::atoi(argv[2]), std::atof(argv[3]), std::atof(argv[4]),
                argc > 5 ? std::strtoull(argv[5], nullptr, 10) : 1);
    return 0;
  }
  weft::Judge(8, 60, 0.1, 2.5, 1);
  weft::Judge(24, 80, 0.1, 2.5, 1);
  weft::Judge(211, 80, 0.1, 4.5, 1);
  return 0;
}
