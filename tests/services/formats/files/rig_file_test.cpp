#include "services/formats/files/rig_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const char kRig[] =
    R"({"cameras": [{"id": "a", "width_px": 100, "height_px": 80, "fx_px": 120.5, "fy_px": 121,
 "cx_px": 50, "cy_px": 40, "distortion": [0.1, 0, 0, 0, 0], "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1],
 "translation_mm": [0, 0.1, 1000]}]})";

std::string RigError(const std::string& part, const std::string& text) {
  std::string json = kRig;
  json.replace(json.find(part), part.size(), text);
  const auto rig = ParseRig(json, "studio/rig.json");
  EXPECT_EQ(rig.status().code(), absl::StatusCode::kInvalidArgument) << json;
  EXPECT_THAT(rig.status().message(), HasSubstr("studio/rig.json"));
  return std::string(rig.status().message());
}

TEST(RigFile, CamerasAloneAreARigAndReadBackWithTheSameHash) {
  auto rig = ParseRig(kRig, "rig.json");
  ASSERT_TRUE(rig.ok()) << rig.status();
  EXPECT_EQ(rig->cameras[0].fx_px, 120.5);
  EXPECT_EQ(rig->cameras[0].translation_mm, Eigen::Vector3d(0, 0.1, 1000));
  const TempFolder folder;
  rig->id = "studio";
  ASSERT_TRUE(WriteRig(folder / "rig.json", *rig, "by hand").ok());
  const auto back = ReadRig(folder / "rig.json");
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->id, "studio");
  EXPECT_EQ(back->ContentHash(), rig->ContentHash());
}

TEST(RigFile, NamesTheCameraAndTheField) {
  EXPECT_THAT(RigError("\"fx_px\"", "\"focal\""), AllOf(HasSubstr("focal"), HasSubstr("unknown field")));
  EXPECT_THAT(RigError("\"fx_px\": 120.5,", ""), AllOf(HasSubstr("id a"), HasSubstr("fx_px is missing")));
  EXPECT_THAT(RigError("[0.1, 0, 0, 0, 0]", "[0.1]"),
              AllOf(HasSubstr("distortion has 1 numbers"), HasSubstr("5 to 8")));
  EXPECT_THAT(RigError("\"fx_px\": 120.5", "\"fx_px\": \"wide\""), HasSubstr("wide"));
  EXPECT_THAT(RigError("{\"cameras\"", "{\"hash\": \"0000000000000000\", \"cameras\""),
              HasSubstr("the field hash says 0000000000000000"));
  EXPECT_THAT(RigError("]}]}", "]}]"), Not(HasSubstr("\n")));
}

CalibrationRecord RecordOfOneCamera() {
  CalibrationRecord record;
  record.version = 3;
  record.replaces = "0123456789abcdef";
  record.calibrated_utc = "2026-01-31T10:45:00Z";
  record.rms_px = 0.125;
  record.stage_low_mm = {-500, -1000, 2000};
  record.stage_high_mm = {500, 1000, 3000};
  CalibratedCamera& camera = record.cameras.emplace_back();
  for (size_t i = 0; i < camera.sigmas.size(); ++i) camera.sigmas[i] = 0.25 * static_cast<double>(i + 1);
  camera.projection_sigma_px = 0.5;
  camera.corner_sigma_px = 0.0625;
  camera.rms_px = 0.25;
  camera.views = 12;
  camera.corners = 345;
  return record;
}

TEST(RigFile, WhatACalibrationKnowsComesBack) {
  const TempFolder folder;
  const Rig rig = *ParseRig(kRig, "rig.json");
  const CalibrationRecord record = RecordOfOneCamera();
  ASSERT_TRUE(WriteRig(folder / "rig.json", rig, "", &record).ok());
  const auto back = ReadCalibrationRecord(folder / "rig.json");
  ASSERT_TRUE(back.ok()) << back.status();
  ASSERT_TRUE(back->has_value());
  const CalibrationRecord& read = **back;
  EXPECT_EQ(read.version, 3);
  EXPECT_EQ(read.replaces, record.replaces);
  EXPECT_EQ(read.calibrated_utc, record.calibrated_utc);
  EXPECT_EQ(read.rms_px, 0.125);
  EXPECT_EQ(read.stage_low_mm, record.stage_low_mm);
  EXPECT_EQ(read.stage_high_mm, record.stage_high_mm);
  ASSERT_EQ(read.cameras.size(), 1u);
  // Angles are degrees in the file.
  for (size_t i = 0; i < read.cameras[0].sigmas.size(); ++i)
    EXPECT_DOUBLE_EQ(read.cameras[0].sigmas[i], record.cameras[0].sigmas[i]) << i;
  EXPECT_EQ(read.cameras[0].corner_sigma_px, 0.0625);
  EXPECT_EQ(read.cameras[0].views, 12);
  EXPECT_EQ(read.cameras[0].corners, 345);
  const auto sigmas = ReadCameraSigmas(folder / "rig.json");
  ASSERT_TRUE(sigmas.ok()) << sigmas.status();
  EXPECT_EQ(*sigmas, std::vector<double>{0.5});
}

TEST(RigFile, ARigFromElsewhereKnowsNothingOfItsCalibration) {
  const TempFolder folder;
  ASSERT_TRUE(WriteRig(folder / "rig.json", *ParseRig(kRig, "rig.json")).ok());
  const auto record = ReadCalibrationRecord(folder / "rig.json");
  ASSERT_TRUE(record.ok()) << record.status();
  EXPECT_FALSE(record->has_value());
  EXPECT_TRUE(ReadCameraSigmas(folder / "rig.json")->empty());
  EXPECT_EQ(ReadCalibrationRecord(folder / "none.json").status().code(), absl::StatusCode::kNotFound);
}

TEST(RigFile, SigmasOfEachCameraAreWhole) {
  const TempFolder folder;
  const Rig rig = *ParseRig(kRig, "rig.json");
  const CalibrationRecord record = RecordOfOneCamera();
  ASSERT_TRUE(WriteRig(folder / "rig.json", rig, "by hand", &record).ok());
  const std::string json = ReadBytes(folder / "rig.json");
  EXPECT_THAT(json, HasSubstr("\"provenance\": \"by hand\""));
  const auto back = ReadCalibrationRecord(folder / "rig.json");
  ASSERT_TRUE(back.ok() && back->has_value());
  EXPECT_EQ((*back)->cameras[0].rms_px, 0.25);
  EXPECT_EQ((*back)->cameras[0].projection_sigma_px, 0.5);
  // The last number of each list of sigmas is gone.
  for (const char* name : {"\"distortion\"", "\"rotation_deg\"", "\"center_mm\""}) {
    const size_t at = json.find(name, json.find("\"sigmas\"")), end = json.find(']', at);
    ASSERT_NE(at, std::string::npos) << json;
    std::string cut = json;
    WriteBytes(folder / "cut.json", cut.erase(json.rfind(',', end), end - json.rfind(',', end)));
    const absl::Status status = ReadCalibrationRecord(folder / "cut.json").status();
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << name;
    EXPECT_THAT(std::string(status.message()),
                HasSubstr("cut.json: camera a: sigmas needs 5 numbers of distortion, 3 of rotation_deg"));
  }
}

TEST(RigFile, CamerasOfARigAreChecked) {
  EXPECT_THAT(RigError("\"fx_px\": 120.5", "\"fx_px\": -120.5"), HasSubstr("studio/rig.json: "));
  EXPECT_THAT(RigError("{\"cameras\"", "solid\n{\"cameras\""), HasSubstr("is no JSON; `weft rig import`"));
}

}  // namespace
}  // namespace weft
