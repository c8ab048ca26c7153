#include "services/studio/recording/doctor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// A machine whose proc and sys are files of the test.
class Machine : public ::testing::Test {
 protected:
  Machine() {
    options_.system_root = folder_ / "machine";
    options_.directory = folder_.path();
    options_.disk_test_gib = 0.01;
    options_.look_for_cameras = false;
    Put("proc/sys/net/core/rmem_max", "212992");
    PutInterface("eth0", "up", "1500", "1000");
    PutInterface("eth1", "up", "9000", "10000");
    PutInterface("eth2", "down", "1500", "-1");
    PutInterface("lo", "unknown", "65536", "");
  }
  void Put(const std::string& path, const std::string& text) {
    const std::filesystem::path file = std::filesystem::path(options_.system_root) / path;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text << "\n";
  }
  void PutInterface(const std::string& name, const char* state, const char* mtu, const char* speed) {
    Put("sys/class/net/" + name + "/operstate", state);
    Put("sys/class/net/" + name + "/mtu", mtu);
    Put("sys/class/net/" + name + "/speed", speed);
  }
  v1::DoctorFinding Of(const std::string& subject) {
    const v1::DoctorReport report = Examine(options_);
    for (const v1::DoctorFinding& finding : report.findings())
      if (finding.subject() == subject) return finding;
    ADD_FAILURE() << "nothing of " << subject << ":\n" << DoctorText(report);
    return {};
  }

  TempFolder folder_;
  DoctorOptions options_;
};

TEST_F(Machine, JudgesInterfacesByTheirPackets) {
  EXPECT_EQ(Of("network eth0").verdict(), v1::DOCTOR_VERDICT_WARNING);
  EXPECT_THAT(Of("network eth0").remedy(), HasSubstr("ip link set eth0 mtu 9000"));
  EXPECT_EQ(Of("network eth1").verdict(), v1::DOCTOR_VERDICT_GOOD);
  EXPECT_THAT(Of("network eth1").found(), HasSubstr("10000 Mbit/s"));
  EXPECT_EQ(Of("network eth2").found(), "down");
}

TEST_F(Machine, WantsLargeSocketBuffers) {
  EXPECT_THAT(Of("socket buffers").remedy(), HasSubstr("sysctl -w net.core.rmem_max="));
  Put("proc/sys/net/core/rmem_max", "33554432");
  EXPECT_EQ(Of("socket buffers").verdict(), v1::DOCTOR_VERDICT_GOOD);
}

TEST_F(Machine, MeasuresTheDiskThatIsNamed) {
  EXPECT_THAT(Of("disk " + options_.directory).found(), HasSubstr("GB/s"));
  EXPECT_TRUE(std::filesystem::exists(options_.directory));
  options_.directory = folder_ / "nowhere";
  EXPECT_EQ(Of("disk " + options_.directory).verdict(), v1::DOCTOR_VERDICT_BAD);
  EXPECT_THAT(DoctorText(Examine(options_)), HasSubstr("BAD      disk"));
}

TEST_F(Machine, SaysWhatHostsLackInPermissionsAndClock) {
  for (const char* subject : {"permissions", "clock"}) {
    const v1::DoctorFinding finding = Of(subject);
    EXPECT_NE(finding.found(), "");
    EXPECT_EQ(finding.remedy().empty(), finding.verdict() == v1::DOCTOR_VERDICT_GOOD);
  }
}

}  // namespace
}  // namespace weft
