// weft camera fake: GigE Vision cameras without hardware.
#include <arpa/inet.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/loopback.h"
#include "capture/image/raw_frame.h"
#include "capture/take/open_dump.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/rig_file.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/output_guard.h"
#include "simulation/gige_emulator/gige_emulator.h"
#include "weft/v1/session.pb.h"

namespace weft {
namespace {

constexpr uint64_t kMostPictures_bytes = uint64_t{2} << 30;

struct FakeCommandOptions {
  int cameras = 2;
  std::string address = "127.0.0.2";  // of the first
  double fps = 10;
  std::string pictures, rig;
  std::string session = "session.json";
  OutputGuard guard;
};

struct FakeCamera {
  std::string id;
  GigeEmulatorImages pictures;
};

const std::map<PixelFormat, RawFormat>& Formats() {
  static const std::map<PixelFormat, RawFormat> formats = {
      {PixelFormat::kGrey8, RawFormat::kMono8},       {PixelFormat::kRgb8, RawFormat::kRgb8},
      {PixelFormat::kBayerRg8, RawFormat::kBayerRg8}, {PixelFormat::kBayerGr8, RawFormat::kBayerGr8},
      {PixelFormat::kBayerGb8, RawFormat::kBayerGb8}, {PixelFormat::kBayerBg8, RawFormat::kBayerBg8}};
  return formats;
}

// The frames of a dump, all in memory.
absl::StatusOr<std::vector<FakeCamera>> CamerasOfDump(const FakeCommandOptions& options) {
  const std::string rig_file =
      options.rig.empty() ? (std::filesystem::path(options.pictures) / "rig.json").string() : options.rig;
  WEFT_ASSIGN_OR_RETURN(const Rig rig, ReadRig(rig_file));
  WEFT_ASSIGN_OR_RETURN(const auto dump, OpenDump(options.pictures, rig));
  std::vector<FakeCamera> cameras;
  uint64_t bytes = 0;
  for (size_t camera = 0; camera < rig.cameras.size(); ++camera) {
    FakeCamera fake{rig.cameras[camera].id, {}};
    for (size_t index = 0; index < dump->frame_names().size(); ++index) {
      WEFT_ASSIGN_OR_RETURN(const Frame frame, dump->ReadView(index, camera));
      fake.pictures.width_px = static_cast<uint32_t>(frame.width_px);
      fake.pictures.height_px = static_cast<uint32_t>(frame.height_px);
      fake.pictures.pixel_format = static_cast<uint32_t>(Formats().at(frame.format));
      fake.pictures.images.push_back(*frame.pixels);
      bytes += frame.pixels->size();
      if (bytes > kMostPictures_bytes)
        return absl::InvalidArgumentError(
            absl::StrCat(options.pictures, ": its pictures take more than ", kMostPictures_bytes >> 30,
                         " GiB of memory; name a dump of fewer frames or cameras"));
    }
    cameras.push_back(std::move(fake));
  }
  return cameras;
}

absl::StatusOr<std::vector<FakeCamera>> CamerasOf(const FakeCommandOptions& options) {
  if (!options.pictures.empty()) return CamerasOfDump(options);
  std::vector<FakeCamera> cameras;
  for (int i = 1; i <= options.cameras; ++i) cameras.push_back({absl::StrFormat("c%02d", i), {}});
  return cameras;
}

absl::StatusOr<std::string> AddressOf(const std::string& first, size_t index) {
  in_addr address{};
  if (inet_pton(AF_INET, first.c_str(), &address) != 1)
    return absl::InvalidArgumentError(
        absl::StrCat("--address \"", first, "\" is no IPv4 address; try 127.0.0.2"));
  address.s_addr = htonl(ntohl(address.s_addr) + static_cast<uint32_t>(index));
  char text[INET_ADDRSTRLEN];
  return std::string(inet_ntop(AF_INET, &address, text, sizeof text));
}

// A session of cameras without hardware is made again as easily as this one.
absl::Status MayWriteSession(const FakeCommandOptions& options) {
  WEFT_RETURN_IF_ERROR(CheckParentFolder(options.session));
  v1::Session before;
  const bool is_known = ReadJsonFile(options.session, before).ok();
  const auto& cameras = before.cameras();
  const bool is_of_fakes =
      is_known && !cameras.empty() && std::ranges::all_of(cameras, [](const auto& camera) {
        return IsLoopbackHost(camera.gige().device()) && camera.gige().features().empty();
      });
  return is_of_fakes ? absl::OkStatus()
                     : options.guard.MayReplace(options.session, "a session of other cameras");
}

absl::Status Serve(const FakeCommandOptions& options) {
  WEFT_RETURN_IF_ERROR(MayWriteSession(options));
  WEFT_ASSIGN_OR_RETURN(std::vector<FakeCamera> fakes, CamerasOf(options));
  v1::Session session;
  session.set_fps(options.fps);
  session.set_ptp(true);
  for (size_t i = 0; i < fakes.size(); ++i) {
    WEFT_ASSIGN_OR_RETURN(const std::string address, AddressOf(options.address, i));
    if (!IsFreeForGigeEmulator(address))
      return absl::FailedPreconditionError(
          absl::StrCat("port 3956 of ", address,
                       " cannot be had: other cameras run there (`weft camera list`), or it is no address of "
                       "this machine; try another --address"));
    v1::SessionCamera& camera = *session.add_cameras();
    camera.set_id(fakes[i].id);
    camera.mutable_gige()->set_device(address);
  }
  // Threads take over the mask: signals wait for this one.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::vector<std::unique_ptr<GigeEmulator>> cameras;
  for (size_t i = 0; i < fakes.size(); ++i)
    cameras.push_back(std::make_unique<GigeEmulator>(
        fakes[i].id, session.cameras(static_cast<int>(i)).gige().device(), std::move(fakes[i].pictures)));
  WEFT_RETURN_IF_ERROR(WriteJsonFile(options.session, session, JsonZeros::kOmitted));
  std::printf(
      "%zu GigE Vision cameras film at %s to %s until Ctrl-C. In another terminal:\n"
      "  weft take record --session %s --out TAKE --seconds 5\n",
      cameras.size(), session.cameras(0).gige().device().c_str(),
      session.cameras(session.cameras_size() - 1).gige().device().c_str(), options.session.c_str());
  std::fflush(stdout);
  int signal = 0;
  sigwait(&signals, &signal);
  return absl::OkStatus();
}

}  // namespace

void AddCameraFakeCommand(CLI::App& camera, CommandLine& line) {
  const auto [fake, options] = AddCommand<FakeCommandOptions>(
      camera, line, Serve, "fake",
      "Run GigE Vision cameras without hardware, on this machine's loopback, and write a session.json that "
      "names them: `weft take record` records them through the network like any others. They have PTP, "
      "packet resend and triggers. They film a pattern, or the pictures of a dump again and again.",
      "  weft camera fake --cameras 4\n"
      "  weft simulate --preset quickstart --out studio && weft camera fake --pictures studio");
  fake->add_option("--cameras", options->cameras, "How many; with --pictures, as many as the rig has")
      ->check(CLI::Range(1, 200));
  AddOption(*fake, "--address IP", options->address, "Of the first; the others follow it");
  fake->add_option("--fps", options->fps, "Frames a second, of the session")->check(CLI::Range(0.1, 1000.0));
  AddOption(*fake, "--pictures DUMP", options->pictures,
            "Dump whose frames they film, a camera per camera of the rig");
  AddOption(*fake, "--rig FILE", options->rig, "rig.json of that dump; without it, rig.json in the dump");
  AddOption(*fake, "--session FILE", options->session, "File to write");
  options->guard.AddTo(*fake);
}

}  // namespace weft
