// What would spoil a recording on this machine, found before it begins.
#pragma once

#include <optional>
#include <string>

#include "weft/v1/doctor.pb.h"
#include "weft/v1/session.pb.h"

namespace weft {

struct DoctorOptions {
  std::string directory = ".";         // where takes are to be recorded
  double disk_test_gib = 0.25;         // written and removed again; 0: none
  std::optional<v1::Session> session;  // its cameras are opened and asked
  bool look_for_cameras = true;
  std::string system_root = "/";  // below which proc and sys are
};

// Checks network interfaces, socket buffers, permissions, clock and disk of the host, and lists the
// cameras that answer. For a session it checks every camera's packet size, clock and data rate, and the
// sum of the rates against links and disk. Findings are in the order of the checks, each with a remedy
// where it is not good. The verdict is that of the worst.
v1::DoctorReport Examine(const DoctorOptions& options);

// Makes the verdict of the findings anew; for reports to which findings were added.
void AssessDoctorReport(v1::DoctorReport& report);

std::string DoctorText(const v1::DoctorReport& report);

}  // namespace weft
