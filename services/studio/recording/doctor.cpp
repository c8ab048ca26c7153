#include "services/studio/recording/doctor.h"

#include <sys/socket.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/strip.h"
#include "capture/camera/camera_source.h"
#include "capture/camera/gige_discovery.h"
#include "capture/camera/v4l2_device.h"
#include "capture/image/raw_frame.h"
#include "services/formats/verdict/verdict.h"
#include "services/studio/recording/disk_speed.h"
#include "services/studio/recording/session_file.h"
#include "services/studio/recording/take_words.h"

namespace weft {
namespace {

constexpr int64_t kWantedBuffer_bytes = 16 << 20;
constexpr int kJumboMtu = 8000;
constexpr double kLinkShare = 0.9;  // of a link that frames can fill
constexpr double kDiskShare = 0.8;
constexpr double kLowDisk_bytes = 20e9;

double LowDisk_bytes(const v1::Session& session) {
  const absl::StatusOr<LiveRecordingOptions> options = RecordingOptionsOf(session);
  return options.ok() ? static_cast<double>(options->recorder.low_disk_bytes) : 0;
}

class Examination {
 public:
  explicit Examination(const DoctorOptions& options) : options_(options), root_(options.system_root) {}

  v1::DoctorReport Run() {
    CheckNetwork();
    CheckBuffers();
    CheckPacketSockets();
    CheckClock();
    if (options_.look_for_cameras) LookForCameras();
    if (options_.session) CheckCameras(*options_.session);
    CheckDisk();
    if (options_.session) CheckBandwidth(*options_.session);
    AssessDoctorReport(report_);
    return std::move(report_);
  }

 private:
  void Find(const std::string& subject, v1::DoctorVerdict verdict, const std::string& found,
            const std::string& remedy = "") {
    v1::DoctorFinding& finding = *report_.add_findings();
    finding.set_subject(subject);
    finding.set_verdict(verdict);
    finding.set_found(found);
    finding.set_remedy(remedy);
  }
  void Good(const std::string& subject, const std::string& found) {
    Find(subject, v1::DOCTOR_VERDICT_GOOD, found);
  }

  // The first line of a file below the root; empty where there is none.
  std::string Line(const std::string& path) const {
    std::ifstream file(root_ / path);
    std::string line;
    std::getline(file, line);
    return line;
  }

  void CheckNetwork();
  void CheckBuffers();
  void CheckPacketSockets();
  void CheckClock();
  void CheckDisk();
  void LookForCameras();
  void CheckCameras(const v1::Session& session);
  double CheckCamera(const v1::Session& session, const v1::SessionCamera& camera);
  void CheckBandwidth(const v1::Session& session);

  const DoctorOptions& options_;
  const std::filesystem::path root_;
  v1::DoctorReport report_;
  double links_bytes_per_s_ = 0;
  double disk_bytes_per_s_ = 0;
  double session_bytes_per_s_ = 0;
};

void Examination::CheckNetwork() {
  std::error_code error;
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(root_ / "sys/class/net", error))
    if (const std::string name = entry.path().filename(); name != "lo") names.push_back(name);
  std::ranges::sort(names);
  for (const std::string& name : names) {
    const std::string subject = "network " + name, folder = "sys/class/net/" + name;
    if (Line(folder + "/operstate") == "down") {
      Find(subject, v1::DOCTOR_VERDICT_WARNING, "down",
           "plug it in, or ignore it where no camera hangs on it");
      continue;
    }
    int mtu = 0, mbit_per_s = 0;
    static_cast<void>(absl::SimpleAtoi(Line(folder + "/mtu"), &mtu));
    const bool has_speed = absl::SimpleAtoi(Line(folder + "/speed"), &mbit_per_s) && mbit_per_s > 0;
    if (has_speed) links_bytes_per_s_ += mbit_per_s * 1e6 / 8;
    const std::string found =
        absl::StrCat("MTU ", mtu, has_speed ? absl::StrCat(", ", mbit_per_s, " Mbit/s") : ", speed unknown");
    if (mtu >= kJumboMtu) {
      Good(subject, found);
    } else {
      Find(subject, v1::DOCTOR_VERDICT_WARNING, found + ": small packets cost six times the work",
           absl::StrCat("`ip link set ", name, " mtu 9000`, and jumbo frames on the switch"));
    }
  }
  if (names.empty())
    Find("network", v1::DOCTOR_VERDICT_WARNING, "no interface but the loopback",
         "GigE Vision cameras need one");
}

void Examination::CheckBuffers() {
  int64_t bytes = 0;
  if (!absl::SimpleAtoi(Line("proc/sys/net/core/rmem_max"), &bytes)) {
    Find("socket buffers", v1::DOCTOR_VERDICT_WARNING, "net.core.rmem_max cannot be read",
         "see `sysctl net.core.rmem_max`");
  } else if (bytes < kWantedBuffer_bytes) {
    Find("socket buffers", v1::DOCTOR_VERDICT_WARNING,
         absl::StrCat("net.core.rmem_max is ", bytes, " bytes: a busy moment of the host loses packets"),
         absl::StrCat("`sysctl -w net.core.rmem_max=", 2 * kWantedBuffer_bytes, "` (and in /etc/sysctl.d)"));
  } else {
    Good("socket buffers", absl::StrCat("net.core.rmem_max is ", bytes, " bytes"));
  }
}

void Examination::CheckPacketSockets() {
  const int fd = socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0);
  if (fd >= 0) {
    close(fd);
    Good("permissions", "packet sockets are allowed");
    return;
  }
  Find("permissions", v1::DOCTOR_VERDICT_WARNING,
       "no packet sockets: frames pass the whole network stack, good to some 250 MB/s",
       "`setcap cap_net_raw+ep $(which weft)`, or record as root");
}

void Examination::CheckClock() {
  timex state{};
  const int answer = adjtimex(&state);
  if (answer != TIME_ERROR && (state.status & STA_UNSYNC) == 0) {
    Good("clock",
         absl::StrFormat("synchronized, to within %.1f ms", static_cast<double>(state.maxerror) / 1e3));
  } else {
    Find("clock", v1::DOCTOR_VERDICT_WARNING,
         "the host's clock is not synchronized: times of takes on several hosts do not compare",
         "run chrony, or ptp4l with phc2sys where cameras use PTP");
  }
}

void Examination::CheckDisk() {
  const std::string subject = "disk " + options_.directory;
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(options_.directory, error);
  if (error) {
    Find(subject, v1::DOCTOR_VERDICT_BAD, error.message(), "make the folder, or name another with --dir");
    return;
  }
  const auto free_bytes = static_cast<double>(space.available);
  std::string found;
  if (options_.disk_test_gib > 0) {
    const auto speed =
        MeasureDiskSpeed(options_.directory, static_cast<uint64_t>(options_.disk_test_gib * (1 << 30)));
    if (!speed.ok()) {
      Find(subject, v1::DOCTOR_VERDICT_BAD, std::string(speed.status().message()),
           "free space, or name another disk with --dir");
      return;
    }
    disk_bytes_per_s_ = speed->bytes_per_s;
    found = absl::StrFormat("; takes %.2f GB/s, slowest write %.0f ms", speed->bytes_per_s / 1e9,
                            speed->slowest_write_ms);
    if (!speed->bypasses_page_cache) found += ", without O_DIRECT";
  }
  const double kept_bytes = options_.session ? LowDisk_bytes(*options_.session) : 0;
  found = RoomText(free_bytes, session_bytes_per_s_, disk_bytes_per_s_, kept_bytes) + found;
  if (kept_bytes > 0 && free_bytes <= kept_bytes) {
    Find(subject, v1::DOCTOR_VERDICT_BAD, found,
         "free space, or lower `low_disk_gib` of the session: recording stops at once");
  } else if (free_bytes < kLowDisk_bytes) {
    Find(subject, v1::DOCTOR_VERDICT_WARNING, found, "free space: recording stops at the low-disk mark");
  } else {
    Good(subject, found);
  }
}

void Examination::LookForCameras() {
  const std::vector<FoundCamera> cameras = FindGigeCameras();
  const std::vector<V4l2Identity> local = FindV4l2Cameras();
  for (const FoundCamera& camera : cameras)
    Good("found",
         absl::StrCat(camera.address, ": ", camera.vendor, " ", camera.model, ", serial ", camera.serial));
  for (const V4l2Identity& camera : local) {
    if (camera.card.empty()) {
      Find("found", v1::DOCTOR_VERDICT_WARNING, absl::StrCat(camera.path, ": this user may not open it"),
           "`usermod -aG video $USER` and log in again");
    } else {
      Good("found", absl::StrCat(camera.path, ": ", camera.card, " at ", camera.bus,
                                 camera.serial.empty() ? "" : ", serial " + camera.serial));
    }
  }
  if (cameras.empty() && local.empty())
    Find("found", v1::DOCTOR_VERDICT_WARNING,
         "no GigE Vision camera answers, and there is none at /dev/video*",
         "power, cables, addresses in the host's subnet, and a firewall that lets UDP port 3956 through");
}

double Examination::CheckCamera(const v1::Session& session, const v1::SessionCamera& camera) {
  v1::Session alone = session;
  alone.clear_cameras();
  *alone.add_cameras() = camera;
  const std::string subject = "camera " + camera.id();
  const auto opened = OpenCameras(alone);
  if (!opened.ok()) {
    Find(subject, v1::DOCTOR_VERDICT_BAD,
         std::string(absl::StripPrefix(opened.status().message(), subject + ": ")),
         "compare its `device` with what `weft camera list` shows; close programs that hold it");
    return 0;
  }
  std::map<std::string, std::string> settings = opened->front()->settings();
  int width_px = 0, height_px = 0, packet_bytes = 0;
  const absl::StatusOr<RawFormat> format = RawFormatFromName(settings["PixelFormat"]);
  const bool known = absl::SimpleAtoi(settings["Width"], &width_px) &&
                     absl::SimpleAtoi(settings["Height"], &height_px) && format.ok();
  static_cast<void>(absl::SimpleAtoi(settings["GevSCPSPacketSize"], &packet_bytes));
  const double bytes_per_s =
      known ? static_cast<double>(RawBytes(*format, width_px, height_px)) * session.fps() : 0;
  std::string found =
      absl::StrFormat("%dx%d %s, %.1f MB/s", width_px, height_px, settings["PixelFormat"], bytes_per_s / 1e6);
  if (camera.has_gige())
    absl::StrAppendFormat(&found, ", packets of %d bytes, resend %s", packet_bytes, settings["PacketResend"]);
  if (!format.ok()) {
    Find(subject, v1::DOCTOR_VERDICT_BAD, found, std::string(format.status().message()));
  } else if (camera.has_gige() && settings["PacketResend"] != "on") {
    Find(subject, v1::DOCTOR_VERDICT_WARNING, found,
         settings["PacketResend"] == "off"
             ? "resend is off in the session: a lost packet costs its frame; take `no_resend` out"
             : "camera cannot resend lost packets: use jumbo frames or a link of its own");
  } else {
    Good(subject, found);
  }
  if (const std::string problem = opened->front()->ClockProblem(); !problem.empty())
    Find("clock of " + subject, v1::DOCTOR_VERDICT_WARNING, "it cannot be read: " + problem,
         "takes put its frames in order by their arrival, as even as the network; PTP makes their times "
         "exact");
  return bytes_per_s;
}

void Examination::CheckCameras(const v1::Session& session) {
  for (const v1::SessionCamera& camera : session.cameras())
    session_bytes_per_s_ += CheckCamera(session, camera);
}

void Examination::CheckBandwidth(const v1::Session& session) {
  const double sum = session_bytes_per_s_;
  if (session.fps() <= 0) {
    Find("bandwidth", v1::DOCTOR_VERDICT_WARNING, "the session names no rate",
         "give `fps` for a sum of the data rates");
    return;
  }
  std::string found = absl::StrFormat("the cameras send %.1f MB/s", sum / 1e6);
  if (links_bytes_per_s_ > 0) absl::StrAppendFormat(&found, ", links carry %.1f", links_bytes_per_s_ / 1e6);
  if (disk_bytes_per_s_ > 0) absl::StrAppendFormat(&found, ", the disk takes %.1f", disk_bytes_per_s_ / 1e6);
  const bool links_full = links_bytes_per_s_ > 0 && sum > kLinkShare * links_bytes_per_s_;
  const bool disk_full = disk_bytes_per_s_ > 0 && sum > kDiskShare * disk_bytes_per_s_;
  if (links_full) {
    Find("bandwidth", v1::DOCTOR_VERDICT_BAD, found,
         "fewer frames a second, 8 bits instead of 12, or more links");
  } else if (disk_full) {
    Find("bandwidth", v1::DOCTOR_VERDICT_BAD, found, "a faster disk, fewer frames a second, or `compress`");
  } else {
    Good("bandwidth", found);
  }
}

// "clock of camera" of "clock of camera c01".
std::string KindOf(const std::string& subject) { return subject.substr(0, subject.rfind(' ')); }

// Findings that differ in their camera or interface alone are one.
struct Line {
  v1::DoctorFinding finding;
  std::vector<std::string> subjects;
};
std::vector<Line> LinesOf(const v1::DoctorReport& report) {
  std::vector<Line> lines;
  for (const v1::DoctorFinding& finding : report.findings()) {
    const auto same = std::ranges::find_if(lines, [&](const Line& line) {
      return line.finding.verdict() == finding.verdict() && line.finding.found() == finding.found() &&
             line.finding.remedy() == finding.remedy() && finding.subject().find(' ') != std::string::npos &&
             KindOf(line.finding.subject()) == KindOf(finding.subject());
    });
    if (same == lines.end()) {
      lines.push_back({finding, {finding.subject()}});
    } else {
      same->subjects.push_back(finding.subject());
    }
  }
  return lines;
}

std::string SubjectOf(const Line& line) {
  if (line.subjects.size() == 1) return line.subjects[0];
  const size_t name = line.subjects[0].rfind(' ') + 1;
  std::vector<std::string> names;
  for (const std::string& subject : line.subjects) names.push_back(subject.substr(name));
  const std::string all = names.size() < 4
                              ? NamesInShort(names)
                              : absl::StrCat(names.front(), " to ", names.back(), " (", names.size(), ")");
  return absl::StrCat(line.subjects[0].substr(0, name - 1), "s ", all);
}

}  // namespace

v1::DoctorReport Examine(const DoctorOptions& options) { return Examination(options).Run(); }

// The first of the gravest findings is the reason.
void AssessDoctorReport(v1::DoctorReport& report) {
  const auto grade_of = [](const v1::DoctorFinding& finding) {
    return finding.verdict() == v1::DOCTOR_VERDICT_BAD       ? v1::GRADE_BAD
           : finding.verdict() == v1::DOCTOR_VERDICT_WARNING ? v1::GRADE_USABLE
                                                             : v1::GRADE_GOOD;
  };
  report.clear_verdict();
  v1::Verdict& verdict = *report.mutable_verdict();
  for (const v1::DoctorFinding& finding : report.findings())
    if (grade_of(finding) != v1::GRADE_GOOD)
      AddFinding(verdict, grade_of(finding), absl::StrCat(finding.subject(), ": ", finding.found()),
                 finding.remedy());
  AddFinding(verdict, v1::GRADE_GOOD, "nothing was found that would spoil a recording", "");
}

std::string DoctorText(const v1::DoctorReport& report) {
  std::string text = VerdictText(report.verdict());
  const std::vector<Line> lines = LinesOf(report);
  size_t width = 0;
  for (const Line& line : lines) width = std::max(width, SubjectOf(line).size());
  for (const Line& line : lines) {
    const char* verdict = line.finding.verdict() == v1::DOCTOR_VERDICT_GOOD      ? "good   "
                          : line.finding.verdict() == v1::DOCTOR_VERDICT_WARNING ? "warning"
                                                                                 : "BAD    ";
    absl::StrAppendFormat(&text, "%s  %-*s  %s\n", verdict, static_cast<int>(width), SubjectOf(line),
                          line.finding.found());
    if (!line.finding.remedy().empty())
      absl::StrAppendFormat(&text, "%*s  -> %s\n", static_cast<int>(width) + 9, "", line.finding.remedy());
  }
  return text;
}

}  // namespace weft
