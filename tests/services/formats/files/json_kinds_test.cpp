#include "services/formats/files/json_kinds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "services/formats/files/json_file.h"
#include "services/formats/files/rig_file.h"
#include "weft/v1/board.pb.h"
#include "weft/v1/calibration.pb.h"
#include "weft/v1/rig.pb.h"
#include "weft/v1/session.pb.h"
#include "weft/v1/template.pb.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

template <typename Message>
std::string KindErrorOf(const std::string& json) {
  Message message;
  return std::string(ParseJson(json, "file.json", message).message());
}

TEST(ParseJson, EveryKindIsToldFromEveryOther) {
  const std::vector<std::pair<std::string, std::string>> kinds = {
      {"a rig", R"({"cameras": [{"id": "c1", "fx_px": 1}]})"},
      {"a board", R"({"id": "b", "rows": 3, "cols": 4, "cell_mm": 2.7})"},
      {"a template", R"({"id": "t", "board_hash": "12", "mesh": "mesh.ply", "cells": "cells.txt"})"},
      {"a session", R"({"fps": 30, "tolerance_ms": 2})"},
      {"a calibration target", R"({"boards": [{"rows": 3, "cols": 4}]})"}};
  for (const auto& [name, json] : kinds) {
    const std::vector<std::pair<std::string, std::string>> errors = {
        {"a rig", KindErrorOf<v1::Rig>(json)},
        {"a board", KindErrorOf<v1::Board>(json)},
        {"a template", KindErrorOf<v1::Template>(json)},
        {"a session", KindErrorOf<v1::Session>(json)},
        {"a calibration target", KindErrorOf<v1::CalibrationTarget>(json)}};
    for (const auto& [wanted, error] : errors) {
      if (wanted == name) {
        EXPECT_EQ(error, "");
      } else {
        EXPECT_THAT(error, AllOf(HasSubstr("file.json: this is " + name), HasSubstr("and " + wanted)));
      }
    }
  }
}

TEST(ParseJson, AMistakeInTheRightKindIsStillNamed) {
  EXPECT_THAT(KindErrorOf<v1::Rig>(R"({"cameras": [{"id": "c1", "focal": 1}]})"),
              AllOf(HasSubstr("focal"), HasSubstr("unknown field")));
}

TEST(ParseRig, WhatIsNoJsonNamesTheImport) {
  EXPECT_THAT(std::string(ParseRig("400002\n4000 0 1185\n", "KRT").status().message()),
              AllOf(HasSubstr("KRT: is no JSON"), HasSubstr("weft rig import")));
}

}  // namespace
}  // namespace weft
