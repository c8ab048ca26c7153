// Every option of options.proto, walked by reflection.
#include "services/formats/options/pipeline_options.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <cmath>

#include "services/formats/options/option_range.h"

namespace weft {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::util::MessageDifferencer;
using ::testing::HasSubstr;

// The message that holds the option, made where it is missing.
Message& OwnerIn(v1::PipelineOptions& options, const OptionField& option) {
  Message* message = &options;
  std::string path = option.path;
  for (size_t dot = path.find('.'); dot != std::string::npos; dot = path.find('.')) {
    const FieldDescriptor* field = message->GetDescriptor()->FindFieldByName(path.substr(0, dot));
    message = message->GetReflection()->MutableMessage(message, field);
    path = path.substr(dot + 1);
  }
  return *message;
}

double Number(v1::PipelineOptions& options, const OptionField& option) {
  Message& owner = OwnerIn(options, option);
  const auto& reflection = *owner.GetReflection();
  switch (option.field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_BOOL:
      return reflection.GetBool(owner, option.field);
    case FieldDescriptor::CPPTYPE_INT32:
      return reflection.GetInt32(owner, option.field);
    case FieldDescriptor::CPPTYPE_UINT32:
      return reflection.GetUInt32(owner, option.field);
    case FieldDescriptor::CPPTYPE_FLOAT:
      return reflection.GetFloat(owner, option.field);
    default:
      return reflection.GetDouble(owner, option.field);
  }
}

void SetNumber(v1::PipelineOptions& options, const OptionField& option, double value) {
  Message& owner = OwnerIn(options, option);
  const auto& reflection = *owner.GetReflection();
  switch (option.field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_BOOL:
      return reflection.SetBool(&owner, option.field, value != 0);
    case FieldDescriptor::CPPTYPE_INT32:
      return reflection.SetInt32(&owner, option.field, static_cast<int>(value));
    case FieldDescriptor::CPPTYPE_UINT32:
      return reflection.SetUInt32(&owner, option.field, static_cast<uint32_t>(value));
    case FieldDescriptor::CPPTYPE_FLOAT:
      return reflection.SetFloat(&owner, option.field, static_cast<float>(value));
    default:
      return reflection.SetDouble(&owner, option.field, value);
  }
}

bool IsWhole(const OptionField& option) {
  return option.field->cpp_type() == FieldDescriptor::CPPTYPE_INT32 ||
         option.field->cpp_type() == FieldDescriptor::CPPTYPE_UINT32;
}

// Another value that the option may have.
double OtherValue(double value, const OptionField& option) {
  if (option.field->cpp_type() == FieldDescriptor::CPPTYPE_BOOL) return 1 - value;
  const v1::OptionAbout& about = option.About();
  const double step = IsWhole(option) ? 1 : std::max(0.01, 0.01 * std::abs(value));
  const bool fits = !(about.has_max() && value + step > about.max()) &&
                    !(about.has_below() && value + step >= about.below());
  return fits ? value + step : value - step;
}

// Values right inside the bounds that the option has.
std::vector<double> InnermostValues(const OptionField& option) {
  const v1::OptionAbout& about = option.About();
  const double step = IsWhole(option) ? 1 : 1e-3;
  std::vector<double> values;
  if (about.has_min()) values.push_back(about.min());
  if (about.has_max()) values.push_back(about.max());
  if (about.has_above()) values.push_back(about.above() + step);
  if (about.has_below()) values.push_back(about.below() - step);
  return values;
}

// Values right outside.
std::vector<double> OuterValues(const OptionField& option) {
  const v1::OptionAbout& about = option.About();
  const double step = IsWhole(option) ? 1 : 1e-3;
  std::vector<double> values;
  if (about.has_min())
    values.push_back(about.min() - (about.min() == 0 ? step : step * std::abs(about.min())));
  if (about.has_max()) values.push_back(about.max() + step * std::abs(about.max()));
  if (about.has_above()) values.push_back(about.above());
  if (about.has_below()) values.push_back(about.below());
  return values;
}

std::vector<OptionField> Leaves() {
  std::vector<OptionField> leaves;
  for (const OptionField& option : AllOptions()) {
    if (!option.IsGroup()) leaves.push_back(option);
  }
  return leaves;
}

TEST(PipelineOptions, EveryOptionReachesItsStructAndComesBack) {
  const v1::PipelineOptions defaults = MessageOf({});
  ASSERT_GT(Leaves().size(), 90u);
  for (const OptionField& option : Leaves()) {
    v1::PipelineOptions all = defaults, one, expected = defaults;
    EXPECT_FALSE(OptionValue(defaults, option).empty()) << option.path << " is not written";
    const double other = OtherValue(Number(all, option), option);
    SetNumber(one, option, other);
    SetNumber(expected, option, other);
    const absl::StatusOr<PipelineOptions> read = ReadOptions(one);
    ASSERT_TRUE(read.ok()) << option.path << ": " << read.status();
    EXPECT_FALSE(MessageDifferencer::Equals(MessageOf(*read), defaults)) << option.path << " is not read";
    EXPECT_TRUE(MessageDifferencer::Equals(MessageOf(*read), expected)) << option.path;
  }
}

TEST(PipelineOptions, EveryOptionAndGroupHasASentence) {
  for (const OptionField& option : AllOptions()) {
    const std::string& text = option.About().text();
    EXPECT_FALSE(text.empty()) << option.path;
    EXPECT_NE(text.back(), '.') << option.path;
    EXPECT_TRUE(option.IsGroup() || option.field->has_presence()) << option.path << " is not optional";
  }
}

// The stages check their options themselves, too.
TEST(PipelineOptions, StagesAcceptTheWholeRangeOfAnOption) {
  for (const OptionField& option : Leaves()) {
    for (const double value : InnermostValues(option)) {
      v1::PipelineOptions options;
      SetNumber(options, option, value);
      EXPECT_TRUE(ReadOptions(options).ok())
          << option.path << " " << value << ": " << ReadOptions(options).status();
    }
  }
}

TEST(PipelineOptions, ValuesBeyondTheRangeAreRefusedByName) {
  for (const OptionField& option : Leaves()) {
    for (const double value : OuterValues(option)) {
      v1::PipelineOptions options;
      SetNumber(options, option, value);
      const absl::Status status = ReadOptions(options).status();
      EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << option.path << " " << value;
      EXPECT_THAT(std::string(status.message()), HasSubstr(option.path + ": "));
      EXPECT_THAT(std::string(status.message()), HasSubstr(option.Range()));
    }
    if (option.field->cpp_type() != FieldDescriptor::CPPTYPE_DOUBLE) continue;
    for (const double value : {std::nan(""), HUGE_VAL}) {
      v1::PipelineOptions options;
      SetNumber(options, option, value);
      EXPECT_FALSE(ReadOptions(options).ok()) << option.path << " " << value;
    }
  }
}

TEST(PipelineOptions, TheTemporalRefinementSolvesAsTheAlignmentDoes) {
  v1::PipelineOptions options;
  options.mutable_alignment()->mutable_elastic()->set_bending(0.7);
  options.mutable_alignment()->mutable_untangle()->set_gap_mm(0.2);
  options.mutable_alignment()->set_remove_self_intersections(false);
  const absl::StatusOr<PipelineOptions> read = ReadOptions(options);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->temporal.elastic.distortion.bending, 0.7);
  EXPECT_EQ(read->temporal.untangle.back.gap_mm, 0.2);
  EXPECT_FALSE(read->temporal.remove_self_intersections);
}

}  // namespace
}  // namespace weft
