#include "services/studio/recording/clock_log.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "absl/strings/str_cat.h"
#include "capture/file/checksum.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

TEST(ClockLog, KeepsReadingsAndTellsOfChangesOfPtp) {
  const TempFolder folder;
  {
    ClockLog log({"left", "right"});
    ASSERT_TRUE(log.Open(folder.path()).ok());
    EXPECT_EQ(log.Add(0, {1000, -5, 3, "Uncalibrated", {}}), "");
    EXPECT_EQ(log.Add(0, {2000, -6, 2, "Slave", -40}), "PTP went from Uncalibrated to Slave");
    EXPECT_EQ(log.Add(1, {2000, 7, 2, "", {}}), "");
    EXPECT_EQ(log.Last(0)->device_minus_host_ns, -6);
  }
  std::ofstream(folder.path() + "/clocks.csv", std::ios::app) << "3000,left,1";  // cut off by a crash
  const std::vector<LoggedReading> readings = ReadClockLog(folder.path(), {}).readings;
  ASSERT_EQ(readings.size(), 3u);
  EXPECT_EQ(readings[1].camera_id, "left");
  EXPECT_EQ(readings[1].reading.ptp_status, "Slave");
  EXPECT_EQ(readings[1].reading.ptp_offset_ns, -40);
  EXPECT_EQ(readings[2].reading.ptp_offset_ns, std::nullopt);
  EXPECT_TRUE(absl::IsNotFound(ParseClockLog(folder.path() + "/none").status()));
  EXPECT_TRUE(ReadClockLog(folder.path() + "/none", {}).readings.empty());
}

// As a take has them whose two cameras were read twice.
class ClosedLog : public ::testing::Test {
 protected:
  ClosedLog() {
    ClockLog log({"left", "right"});
    EXPECT_TRUE(log.Open(folder_.path()).ok());
    for (int64_t second = 1; second <= 2; ++second)
      for (const size_t camera : {size_t{0}, size_t{1}})
        log.Add(camera, {second * 1'000'000'000, -5 - second, 3, "Slave", -40});
    EXPECT_EQ(log.end_checksum(), "");
    EXPECT_TRUE(log.Close().ok());
    checksum_ = log.end_checksum();
    text_ = ReadBytes(File());
  }
  std::string File() const { return ClockLogFile(folder_.path()); }
  ParsedClockLog Parsed(const std::string& text) const {
    WriteBytes(File(), text);
    return ParseClockLog(folder_.path()).value_or(ParsedClockLog{});
  }
  bool IsWhole(const std::string& text) const {
    const ParsedClockLog log = Parsed(text);
    return log.has_checksums && log.has_end && log.damaged_lines == 0;
  }

  TempFolder folder_;
  std::string text_, checksum_;
};

TEST_F(ClosedLog, IsReadAsItWasWritten) {
  EXPECT_TRUE(IsWhole(text_));
  const ParsedClockLog log = Parsed(text_);
  ASSERT_EQ(log.readings.size(), 4u);
  EXPECT_EQ(log.readings[3].camera_id, "right");
  EXPECT_EQ(log.readings[3].reading.device_minus_host_ns, -7);
  EXPECT_EQ(ClockLogText(log.readings), text_);
  EXPECT_EQ(log.end_checksum, checksum_);
}

TEST_F(ClosedLog, OneThatTheTakeDoesNotNameIsNotRead) {
  const auto damage = [this] { return ReadClockLog(folder_.path(), {checksum_, true}).damage; };
  const auto readings = [this] { return ReadClockLog(folder_.path(), {checksum_, true}).readings.size(); };
  EXPECT_EQ(damage(), "");
  EXPECT_EQ(readings(), 4u);
  const std::string other = ClockLogText({{"left", {1'000'000'000, 499'999'994, 3, "Slave", -40}}});
  const std::string old =
      other.substr(0, other.find(",checksum")) + "\n1000000000,left,499999994,3,Slave,-40\n";
  for (const std::string& text : {other, old, ClockLogText({})}) {
    WriteBytes(File(), text);
    EXPECT_EQ(damage(), "clocks.csv: is not the one that was written with this take, and is not read");
    EXPECT_EQ(readings(), 0u);
    EXPECT_EQ(ReadClockLog(folder_.path(), {"", true}).damage, "");  // takes of earlier versions name none
  }
  std::filesystem::remove(File());
  EXPECT_EQ(damage(), "clocks.csv: is missing");
  EXPECT_EQ(ReadClockLog(folder_.path(), {"", true}).damage, "");
  // What is damaged in part is read in part.
  WriteBytes(File(), text_.substr(0, text_.size() / 2));
  EXPECT_EQ(readings(), 1u);
  std::string damaged = text_;
  damaged[text_.find("2000000000")] = '9';
  WriteBytes(File(), damaged);
  EXPECT_EQ(damage(), "clocks.csv: line 4 is not as it was written, 1 in all; its other lines are read");
  EXPECT_EQ(readings(), 3u);
}

TEST_F(ClosedLog, EveryByteThatChangesIsSeen) {
  for (size_t at = 0; at < text_.size(); ++at) {
    for (const char bit : {1, 16}) {
      std::string changed = text_;
      changed[at] = static_cast<char>(changed[at] ^ bit);
      EXPECT_FALSE(IsWhole(changed)) << "byte " << at;
    }
    EXPECT_FALSE(IsWhole(text_.substr(0, at))) << "cut at " << at;
  }
}

TEST_F(ClosedLog, LinesThatAreGoneOrMovedOrTwiceAreSeen) {
  std::vector<std::string> lines;
  std::istringstream in(text_);
  for (std::string line; std::getline(in, line);) lines.push_back(line + "\n");
  ASSERT_EQ(lines.size(), 6u);
  const auto joined = [](const std::vector<std::string>& some) {
    std::string all;
    for (const std::string& line : some) all += line;
    return all;
  };
  for (size_t i = 1; i < lines.size(); ++i) {
    std::vector<std::string> changed = lines;
    changed.erase(changed.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_FALSE(IsWhole(joined(changed))) << "without line " << i;
    changed = lines;
    changed.insert(changed.begin() + static_cast<std::ptrdiff_t>(i), lines[i]);
    EXPECT_FALSE(IsWhole(joined(changed))) << "line " << i << " twice";
    if (i + 1 == lines.size()) continue;
    changed = lines;
    std::swap(changed[i], changed[i + 1]);
    EXPECT_FALSE(IsWhole(joined(changed))) << "line " << i << " moved";
  }
  // One damaged line costs itself alone.
  lines[2][0] = '9';
  const ParsedClockLog log = Parsed(joined(lines));
  EXPECT_EQ(log.readings.size(), 3u);
  EXPECT_EQ(log.damaged_lines, 1u);
  EXPECT_EQ(log.damage, "line 3 is not as it was written");
}

TEST(ClockLog, OfEarlierVersionsHasNoChecksums) {
  const TempFolder folder;
  const std::string heading =
      "host_time_ns,camera,device_minus_host_ns,uncertainty_ns,ptp_status,ptp_offset_ns\n";
  WriteBytes(ClockLogFile(folder.path()), heading + "1000,left,-5,3,Slave,-40\n2000,left,-6,3,,\nhalf");
  const absl::StatusOr<ParsedClockLog> log = ParseClockLog(folder.path());
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_FALSE(log->has_checksums);
  EXPECT_EQ(log->readings.size(), 2u);
  EXPECT_EQ(log->damaged_lines, 1u);
  EXPECT_TRUE(log->is_cut);
  WriteBytes(ClockLogFile(folder.path()), "something else\n");
  EXPECT_EQ(ParseClockLog(folder.path()).status().code(), absl::StatusCode::kDataLoss);
}

TEST(ClockLog, OfACameraThatIsDistrustedNothingMoreIsKept) {
  const TempFolder folder;
  ClockLog clocks({"left", "right"});
  ASSERT_TRUE(clocks.Open(folder.path()).ok());
  EXPECT_EQ(clocks.Add(0, {1000, -5, 3, "Listening", {}}), "");
  EXPECT_EQ(clocks.Add(0, {2000, -5, 3, "Slave", {}}), "PTP went from Listening to Slave");
  EXPECT_EQ(clocks.Add(0, {3000, -5, 3, "Slave", {}}), "");
  EXPECT_EQ(clocks.Add(1, {1000, -7, 3, "", {}}), "");
  EXPECT_EQ(clocks.Last(0)->host_time_ns, 3000);
  clocks.Distrust(0);
  EXPECT_FALSE(clocks.Last(0).has_value());
  EXPECT_EQ(clocks.Add(0, {4000, -5, 3, "Master", {}}), "");
  EXPECT_FALSE(clocks.Last(0).has_value());
  EXPECT_EQ(clocks.Last(1)->device_minus_host_ns, -7);
  ASSERT_TRUE(clocks.Close().ok());
  EXPECT_TRUE(clocks.Close().ok()) << "it is closed";
  const auto log = ParseClockLog(folder.path());
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_TRUE(log->has_end);
  EXPECT_EQ(log->readings.size(), 4u);
}

TEST(ClockLog, AReadingBehindTheEndIsNone) {
  const TempFolder folder;
  ClockLog clocks({"left"});
  ASSERT_TRUE(clocks.Open(folder.path()).ok());
  clocks.Add(0, {1000, -5, 3, "", {}});
  ASSERT_TRUE(clocks.Close().ok());
  const std::string closed = ReadBytes(ClockLogFile(folder.path()));
  // The same again, from the first reading on, with checksums that follow each other.
  const std::string longer = ClockLogText({{"left", {1000, -5, 3, "", {}}}, {"left", {2000, -5, 3, "", {}}}});
  const std::string last = longer.substr(closed.rfind('\n', closed.size() - 2) + 1);
  WriteBytes(ClockLogFile(folder.path()), closed + last);
  const auto log = ParseClockLog(folder.path());
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->readings.size(), 1u);
  EXPECT_GT(log->damaged_lines, 0u);
  EXPECT_EQ(log->damage, "line 4 is not as it was written");
  // Nor one whose checksum follows that of the end.
  WriteBytes(ClockLogFile(folder.path()), closed);
  const std::string end = ParseClockLog(folder.path())->end_checksum, reading = "2000,left,-5,3,,";
  const std::string sealed = end + reading;
  WriteBytes(ClockLogFile(folder.path()),
             absl::StrCat(closed, reading, ",",
                          absl::Hex(Checksum(sealed.data(), sealed.size()), absl::kZeroPad16), "\n"));
  const auto forged = ParseClockLog(folder.path());
  ASSERT_TRUE(forged.ok()) << forged.status();
  EXPECT_EQ(forged->readings.size(), 1u);
  EXPECT_EQ(forged->damage, "line 4 is not as it was written");
}

}  // namespace
}  // namespace weft
