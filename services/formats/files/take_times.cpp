#include "services/formats/files/take_times.h"

#include <cmath>
#include <filesystem>
#include <memory>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "capture/take/take_files.h"
#include "capture/take/take_view.h"
#include "services/formats/files/text_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// Frames per second by the times of the pictures of a camera in <truth>/pictures.csv
// (frame,camera,mid_exposure_ns,lost); 0 where they do not tell.
double FpsOfTruth(const std::string& truth) {
  const absl::StatusOr<std::string> csv = ReadTextFile((fs::path(truth) / "pictures.csv").string());
  if (!csv.ok()) return 0;
  std::string camera;
  std::vector<double> times_ns;
  for (const auto line : absl::StrSplit(*csv, '\n')) {
    const std::vector<std::string> fields = absl::StrSplit(line, ',');
    double time_ns = 0;
    if (fields.size() < 3 || !absl::SimpleAtod(fields[2], &time_ns)) continue;
    if (camera.empty()) camera = fields[1];
    if (fields[1] == camera) times_ns.push_back(time_ns);
  }
  if (times_ns.size() < 2 || !(times_ns.back() > times_ns.front())) return 0;
  return 1e9 * static_cast<double>(times_ns.size() - 1) / (times_ns.back() - times_ns.front());
}

}  // namespace

double NominalRate(double fps) {
  constexpr double kRounding_ns = 1, kNtsc = 1.001, kMostRelative = 1e-6;
  if (!(fps > 0)) return fps;
  for (const double rate : {std::round(fps), std::round(kNtsc * fps) / kNtsc})
    if (rate > 0 && std::abs(1e9 / rate - 1e9 / fps) < kRounding_ns &&
        std::abs(rate / fps - 1) < kMostRelative)
      return rate;
  return fps;
}

TakeTimes TimesOfTake(const std::string& dump, const std::string& truth) {
  TakeTimes times;
  if (!dump.empty() && IsRecordedTake(dump)) {
    const absl::StatusOr<std::unique_ptr<RecordedTake>> take = RecordedTake::Open(dump);
    if (!take.ok()) return times;
    for (const uint64_t set : (*take)->sets()) times.positions.push_back(static_cast<int64_t>(set));
    if (const int64_t period_ns = PeriodOf_ns(**take); period_ns > 0) {
      times.fps = 1e9 / static_cast<double>(period_ns);
      times.source = "the take's times";
    }
    return times;
  }
  if (!truth.empty()) times.fps = FpsOfTruth(truth);
  if (times.fps > 0)
    times.source = absl::StrCat("the times in ", (fs::path(truth) / "pictures.csv").string());
  return times;
}

}  // namespace weft
