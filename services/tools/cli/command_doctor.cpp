// weft doctor: what would spoil a recording on this machine?
#include <string>

#include "services/formats/verdict/verdict.h"
#include "services/studio/recording/doctor.h"
#include "services/studio/recording/session_file.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/installation_options.h"
#include "services/tools/cli/json_output.h"

namespace weft {
namespace {

struct DoctorCommandOptions {
  DoctorOptions doctor;
  InstallationOptions installation;
  std::string session;
  bool no_cameras = false;
  bool json = false;
};

absl::Status RunDoctor(DoctorCommandOptions& options) {
  if (!options.session.empty()) {
    WEFT_ASSIGN_OR_RETURN(options.doctor.session, ReadSession(options.session));
  }
  options.doctor.look_for_cameras = !options.no_cameras;
  v1::DoctorReport report = Examine(options.doctor);
  ExamineInstallation(options.installation, report);
  AssessDoctorReport(report);
  WEFT_RETURN_IF_ERROR(PrintMessage(report, options.json, DoctorText(report)));
  return VerdictStatus(report.verdict());
}

}  // namespace

void AddDoctorCommand(CLI::App& app, CommandLine& line) {
  const auto [doctor, options] = AddCommand<DoctorCommandOptions>(
      app, line, RunDoctor, "doctor",
      "Look for what would spoil a recording on this machine: network, socket buffers, permissions, clock, "
      "disk, cameras, and the data rate of a session; and at the installation: programs, kernel, the daemon, "
      "its state folder, certificates and tokens. Each finding has a remedy. Exit status 1 when frames would "
      "be lost or the daemon does not work.",
      "  weft doctor --dir /data/takes\n"
      "  weft doctor --session session.json --dir /data/takes\n"
      "  weft doctor --config /etc/weft/weftd.txtpb --no-cameras --disk-test-gib 0");
  AddOption(*doctor, "--session FILE", options->session,
            "session.json: opens its cameras and sums their data rates");
  AddOption(*doctor, "--dir DIR", options->doctor.directory, "Where takes are to be recorded");
  AddOption(*doctor, "--disk-test-gib GIB", options->doctor.disk_test_gib,
            "How much to write in testing the disk; 0: nothing", CLI::Range(0.0, 1024.0));
  AddInstallationOptions(*doctor, options->installation);
  doctor->add_flag("--no-cameras", options->no_cameras, "Do not search for cameras in the network");
  doctor->add_flag("--json", options->json, "Print JSON (weft.v1.DoctorReport)");
}

}  // namespace weft
