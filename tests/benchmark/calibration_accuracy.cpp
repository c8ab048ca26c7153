// Calibrates simulated rigs from projected corners and compares with the rig that made them:
//   accuracy_calibration [CAMERAS FRAMES NOISE_PX LONGEST_LENS [SEED]]
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "base/stopwatch.h"
#include "tests/capture/calibration/simulated_calibration.h"

namespace weft {
namespace {

// Errors in sigmas of one kind of unknown, all cameras together: without a bias the mean is 0, within its own
// sigma, and the root mean square 1.
void PrintKind(const ErrorsAndSigmas& compared, const char* name, const CalibrationSolution& solution,
               Eigen::Index first, Eigen::Index count) {
  const Eigen::Index cameras = static_cast<Eigen::Index>(solution.cameras.size());
  const double n = static_cast<double>(cameras * count);
  Eigen::VectorXd mean_of = Eigen::VectorXd::Zero(compared.errors.size());
  double squares = 0, worst = 0;
  Eigen::Index worst_camera = 0;
  for (Eigen::Index i = 0; i < cameras * count; ++i) {
    const Eigen::Index at = 15 * (i / count) + first + i % count;
    const double sigma = std::sqrt(compared.covariance(at, at));
    const double z = compared.errors[at] / sigma;
    mean_of[at] = 1 / sigma / n;
    squares += z * z;
    if (std::abs(z) > std::abs(worst)) worst = z, worst_camera = i / count;
  }
  const double mean = mean_of.dot(compared.errors);
  std::printf(
      "    %-8s mean %+.3f (%+.1f of its sigma), rms %.3f, worst %+.1f of camera %s with %d corners\n", name,
      mean, mean / std::sqrt(mean_of.dot(compared.covariance * mean_of)), std::sqrt(squares / n), worst,
      solution.bundle.cameras[worst_camera].id.c_str(), solution.cameras[worst_camera].corners);
}

void PrintErrorsInSigmas(const ErrorsAndSigmas& compared, const CalibrationSolution& solution) {
  std::printf("  errors in sigmas:\n");
  const char* names[] = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
  for (int i = 0; i < 9; ++i) PrintKind(compared, names[i], solution, i, 1);
  PrintKind(compared, "turns", solution, 9, 3);
  PrintKind(compared, "centres", solution, 12, 3);
}

void Assess(int cameras, int frames, double noise_px, double longest, uint64_t seed) {
  const SimulatedCalibration truth = Simulate(cameras, frames, noise_px, longest, {}, seed);
  size_t corners = 0;
  for (const BoardView& view : truth.views.boards) corners += view.corners.size();
  std::printf("%d cameras, %d frames, %zu views, %zu corners, noise %.3f px\n", cameras, frames,
              truth.views.boards.size(), corners, noise_px);
  const std::clock_t start = std::clock();
  const Stopwatch watch;
  std::string last;
  const auto solved = SolveCalibration(
      truth.moved.target, truth.views, std::nullopt, {}, [&](const std::string& stage, double) {
        if (stage != last)
          std::fprintf(stderr, "  %s at %.1f s\n", stage.c_str(),
                       static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
        last = stage;
      });
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  const double wall_s = watch.Seconds();
  if (!solved.ok()) {
    std::printf("  %s\n", solved.status().ToString().c_str());
    return;
  }
  const ErrorsAndSigmas compared = Compare(*solved, truth);
  double lens = 0, pose = 0, worst = 0, center_mm = 0, projection_px = 0;
  int worst_camera = 0;
  for (int c = 0; c < cameras; ++c) {
    lens += compared.ChiSquareOf(15 * c, 9) / 9 / cameras;
    pose += compared.ChiSquareOf(15 * c + 9, 6) / 6 / cameras;
    if (const double of = compared.ChiSquareOf(15 * c, 15); of > worst) worst = of, worst_camera = c;
    center_mm += compared.errors.segment<3>(15 * c + 12).squaredNorm() / cameras;
    projection_px = std::max(projection_px, solved->cameras[c].projection_sigma_px);
  }
  std::printf("  %.1f s, %.1f s of processor time, %d iterations%s\n", wall_s, seconds, solved->iterations,
              solved->converged ? "" : ", not converged");
  std::printf("  residuals %.4f px, variance factor %.4f\n", solved->rms_px, solved->variance_factor);
  std::printf(
      "  chi-square per freedom: all together %.3f (%.1f sigmas off), lenses %.2f, poses %.2f, worst camera "
      "%.1f of 15 (%d corners)\n",
      compared.per_freedom(), compared.sigmas_off(), lens, pose, worst,
      solved->cameras[worst_camera].corners);
  std::printf("  likelihood ratio of the true rig per freedom: %.3f\n",
              LikelihoodRatio(*solved, truth) / compared.freedom);
  std::printf("  centres %.3f mm rms, worst stage sigma %.3f px\n", std::sqrt(center_mm), projection_px);
  PrintErrorsInSigmas(compared, *solved);
  std::fflush(stdout);
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) {
  if (argc >= 5) {
    weft::Assess(std::atoi(argv[1]), std::atoi(argv[2]), std::atof(argv[3]), std::atof(argv[4]),
                 argc > 5 ? std::strtoull(argv[5], nullptr, 10) : 1);
    return 0;
  }
  weft::Assess(8, 60, 0.1, 2.5, 1);
  weft::Assess(24, 80, 0.1, 2.5, 1);
  weft::Assess(211, 80, 0.1, 4.5, 1);
  return 0;
}
