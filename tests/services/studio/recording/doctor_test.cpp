#include "services/studio/recording/doctor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"

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

TEST_F(Machine, JumboFramesBeginAt8000Bytes) {
  PutInterface("eth0", "up", "7999", "-1");
  EXPECT_EQ(Of("network eth0").found(), "MTU 7999, speed unknown: small packets cost six times the work");
  PutInterface("eth0", "up", "8000", "1");
  EXPECT_EQ(Of("network eth0").verdict(), v1::DOCTOR_VERDICT_GOOD);
  EXPECT_EQ(Of("network eth0").found(), "MTU 8000, 1 Mbit/s");
}

TEST_F(Machine, WithoutInterfacesHasNoCamerasOfTheNetwork) {
  std::filesystem::remove_all(std::filesystem::path(options_.system_root) / "sys/class/net");
  EXPECT_EQ(Of("network").verdict(), v1::DOCTOR_VERDICT_WARNING);
  PutInterface("lo", "unknown", "65536", "");
  EXPECT_EQ(Of("network").found(), "no interface but the loopback");
}

TEST_F(Machine, SocketBuffersAreLargeFrom16Mebibytes) {
  Put("proc/sys/net/core/rmem_max", "16777216");
  EXPECT_EQ(Of("socket buffers").found(), "net.core.rmem_max is 16777216 bytes");
  Put("proc/sys/net/core/rmem_max", "16777215");
  EXPECT_EQ(Of("socket buffers").verdict(), v1::DOCTOR_VERDICT_WARNING);
  EXPECT_THAT(Of("socket buffers").remedy(), HasSubstr("rmem_max=33554432"));
  Put("proc/sys/net/core/rmem_max", "many");
  EXPECT_EQ(Of("socket buffers").found(), "net.core.rmem_max cannot be read");
}

// A session that replays a take of one camera, 3,072 bytes a frame.
class MachineWithSession : public Machine {
 protected:
  MachineWithSession() {
    PatternFrames frames({"left"}, 64, 48);
    RecordPattern(folder_ / "take", frames);
    options_.disk_test_gib = 0;
    options_.session.emplace();
    session().set_fps(10);
    v1::SessionCamera& camera = *session().add_cameras();
    camera.set_id("left");
    camera.mutable_replay()->set_take(folder_ / "take");
  }
  v1::Session& session() { return *options_.session; }
};

TEST_F(MachineWithSession, AsksEveryCamera) {
  EXPECT_EQ(Of("camera left").verdict(), v1::DOCTOR_VERDICT_GOOD);
  EXPECT_EQ(Of("camera left").found(), "64x48 BayerRG8, 0.0 MB/s");
  session().mutable_cameras(0)->mutable_replay()->set_take(folder_ / "nothing");
  const v1::DoctorFinding gone = Of("camera left");
  EXPECT_EQ(gone.verdict(), v1::DOCTOR_VERDICT_BAD);
  EXPECT_THAT(gone.remedy(), HasSubstr("weft camera list"));
  EXPECT_THAT(gone.found(), ::testing::Not(HasSubstr("camera left: ")));
}

// Interfaces that are up carry 11 Gbit/s, of which frames fill nine tenths: 1237.5 MB/s.
TEST_F(MachineWithSession, ComparesTheSumOfTheRatesWithTheLinks) {
  session().set_fps(402832);
  EXPECT_EQ(Of("bandwidth").verdict(), v1::DOCTOR_VERDICT_GOOD);
  EXPECT_EQ(Of("bandwidth").found(), "the cameras send 1237.5 MB/s, links carry 1375.0");
  session().set_fps(402833);
  EXPECT_EQ(Of("bandwidth").verdict(), v1::DOCTOR_VERDICT_BAD);
  EXPECT_THAT(Of("bandwidth").remedy(), HasSubstr("more links"));
  session().set_fps(0);
  EXPECT_EQ(Of("bandwidth").found(), "the session names no rate");
  EXPECT_EQ(Of("bandwidth").verdict(), v1::DOCTOR_VERDICT_WARNING);
}

// No disk takes 300 TB/s.
TEST_F(MachineWithSession, ComparesTheSumOfTheRatesWithTheDisk) {
  std::filesystem::remove_all(std::filesystem::path(options_.system_root) / "sys/class/net");
  session().set_fps(1e8);
  EXPECT_EQ(Of("bandwidth").found(), "the cameras send 307200.0 MB/s");
  EXPECT_EQ(Of("bandwidth").verdict(), v1::DOCTOR_VERDICT_GOOD) << "nothing is known of the disk";
  options_.disk_test_gib = 0.01;
  EXPECT_EQ(Of("bandwidth").verdict(), v1::DOCTOR_VERDICT_BAD);
  EXPECT_THAT(Of("bandwidth").remedy(), HasSubstr("a faster disk"));
}

TEST_F(MachineWithSession, ADiskBelowTheSessionsMarkIsBad) {
  session().set_low_disk_gib(1e6);
  EXPECT_EQ(Of("disk " + options_.directory).verdict(), v1::DOCTOR_VERDICT_BAD);
  EXPECT_THAT(Of("disk " + options_.directory).remedy(), HasSubstr("recording stops at once"));
}

void AddDoctorFinding(v1::DoctorReport& report, const std::string& subject, v1::DoctorVerdict verdict,
                      const std::string& found) {
  v1::DoctorFinding& finding = *report.add_findings();
  finding.set_subject(subject);
  finding.set_verdict(verdict);
  finding.set_found(found);
  finding.set_remedy(verdict == v1::DOCTOR_VERDICT_GOOD ? "" : "remedy of " + found);
}

TEST(DoctorReport, ItsVerdictIsThatOfTheGravestFinding) {
  v1::DoctorReport report;
  AddDoctorFinding(report, "clock", v1::DOCTOR_VERDICT_GOOD, "right");
  AssessDoctorReport(report);
  EXPECT_EQ(report.verdict().grade(), v1::GRADE_GOOD);
  EXPECT_EQ(report.verdict().reason(), "nothing was found that would spoil a recording");
  AddDoctorFinding(report, "disk", v1::DOCTOR_VERDICT_WARNING, "slow");
  AssessDoctorReport(report);
  EXPECT_EQ(report.verdict().grade(), v1::GRADE_USABLE);
  AddDoctorFinding(report, "camera a", v1::DOCTOR_VERDICT_BAD, "gone");
  AddDoctorFinding(report, "camera b", v1::DOCTOR_VERDICT_BAD, "late");
  AssessDoctorReport(report);
  EXPECT_EQ(report.verdict().grade(), v1::GRADE_BAD);
  EXPECT_EQ(report.verdict().reason(), "camera a: gone");
  EXPECT_EQ(report.verdict().remedy(), "remedy of gone");
}

TEST(DoctorReport, FindingsThatDifferInTheirCameraAloneAreOneLine) {
  v1::DoctorReport report;
  for (const char* id : {"c01", "c02", "c03"})
    AddDoctorFinding(report, std::string("camera ") + id, v1::DOCTOR_VERDICT_GOOD, "fine");
  AddDoctorFinding(report, "camera c04", v1::DOCTOR_VERDICT_WARNING, "fine");
  for (const char* id : {"1", "2", "3", "4"})
    AddDoctorFinding(report, std::string("network eth") + id, v1::DOCTOR_VERDICT_BAD, "down");
  AddDoctorFinding(report, "clock", v1::DOCTOR_VERDICT_GOOD, "fine");
  AddDoctorFinding(report, "clock", v1::DOCTOR_VERDICT_GOOD, "fine");
  AssessDoctorReport(report);
  const std::string text = DoctorText(report);
  EXPECT_THAT(text, HasSubstr("good     cameras c01, c02 and c03   fine\n"
                              "warning  camera c04                 fine\n"
                              "                                    -> remedy of fine\n"
                              "BAD      networks eth1 to eth4 (4)  down\n"
                              "                                    -> remedy of down\n"
                              "good     clock                      fine\n"
                              "good     clock                      fine\n"));
}

}  // namespace
}  // namespace weft
