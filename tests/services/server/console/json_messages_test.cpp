#include "services/server/console/json_messages.h"

#include <gtest/gtest.h>

#include "weft/v1/console.pb.h"
#include "weft/v1/jobs.pb.h"

namespace weft {
namespace {

TEST(FindMethod, KnowsTheApiByItsSchemas) {
  ASSERT_NE(FindMethod("Jobs/ListJobs"), nullptr);
  EXPECT_EQ(FindMethod("Jobs.ListJobs"), FindMethod("Jobs/ListJobs"));
  EXPECT_TRUE(FindMethod("Jobs.WatchJob")->server_streaming());
  for (const char* name :
       {"", "Jobs", "Jobs/", "/ListJobs", "Jobs/Nothing", "Nothing/ListJobs", "weft.v1.Jobs/ListJobs"})
    EXPECT_EQ(FindMethod(name), nullptr) << name;
}

TEST(JsonMessages, RequestsAndAnswersKeepWhatTheySay) {
  const google::protobuf::MethodDescriptor* method = FindMethod("Jobs/GetJob");
  const auto wire = RequestOfJson(*method->input_type(), "{\"jobId\": \"a\"}");
  ASSERT_TRUE(wire.ok()) << wire.status();
  v1::GetJobRequest request;
  ASSERT_TRUE(request.ParseFromString(*wire));
  EXPECT_EQ(request.job_id(), "a");
  const auto json = JsonOfAnswer(*method->input_type(), *wire);
  ASSERT_TRUE(json.ok()) << json.status();
  EXPECT_EQ(*json, "{\"jobId\":\"a\"}");
  EXPECT_NE(RequestOfJson(*method->input_type(), "{\"nothing\": 1}").status().message().find("nothing"),
            std::string::npos);
  EXPECT_FALSE(RequestOfJson(*method->input_type(), "{").ok());
  EXPECT_FALSE(JsonOfAnswer(*method->input_type(), "\xff\xff").ok());
}

TEST(JsonMessages, QueriesFillFieldsOfTextNumbersAndEnums) {
  const google::protobuf::Descriptor& type = *FindMethod("Jobs/FetchResult")->input_type();
  const auto wire = RequestOfQuery(type, {{"job_id", "a b"}, {"kind", "RESULT_KIND_MESH"}, {"offset", "12"}});
  ASSERT_TRUE(wire.ok()) << wire.status();
  v1::FetchResultRequest request;
  ASSERT_TRUE(request.ParseFromString(*wire));
  EXPECT_EQ(request.job_id(), "a b");
  EXPECT_EQ(request.kind(), v1::RESULT_KIND_MESH);
  EXPECT_EQ(request.offset(), 12);
  for (const auto& [name, value] :
       {std::pair("kind", "RESULT_KIND_SOUP"), {"offset", "many"}, {"color", "red"}, {"job_id", "\xff"}})
    EXPECT_NE(RequestOfQuery(type, {{name, value}}).status().message().find(name), std::string::npos) << name;
}

TEST(JsonMessages, ErrorsHaveCodeAndMessage) {
  v1::ConsoleError error;
  ASSERT_TRUE(FromJson(JsonOfStatus(absl::NotFoundError("no such job")), error).ok());
  EXPECT_EQ(error.code(), "NOT_FOUND");
  EXPECT_EQ(error.message(), "no such job");
}

TEST(FindMethod, LeavesOutThoseToWhichAStreamIsSent) {
  EXPECT_EQ(FindMethod("Library/WriteFile"), nullptr);
  EXPECT_NE(FindMethod("Library/FetchFile"), nullptr);
}

TEST(JsonMessages, QueriesSayWhatIsNoValue) {
  const google::protobuf::Descriptor& type = *FindMethod("Jobs/FetchResult")->input_type();
  EXPECT_EQ(RequestOfQuery(type, {{"offset", "many"}}).status(),
            absl::InvalidArgumentError("offset: \"many\" is no value of FetchResultRequest"));
  EXPECT_EQ(RequestOfQuery(type, {{"job_id", "a\xff"}}).status(),
            absl::InvalidArgumentError("job_id: \"a\\xff\" is no value of FetchResultRequest"));
  EXPECT_EQ(RequestOfQuery(type, {}).value(), "");
  // Fields of messages, lists and other numbers are for JSON.
  EXPECT_FALSE(RequestOfQuery(*FindMethod("Jobs/SubmitJob")->input_type(), {{"spec", "x"}}).ok());
  EXPECT_FALSE(RequestOfQuery(*FindMethod("Jobs/SubmitJob")->input_type(), {{"priority", "1"}}).ok());
}

TEST(JsonMessages, RequestsHaveLimits) {
  v1::ConsoleLogin login;
  const std::string begin = "{\"token\": \"", end = "\"}";
  const std::string most = begin + std::string((1 << 20) - begin.size() - end.size(), 't') + end;
  EXPECT_TRUE(FromJson(most, login).ok());
  EXPECT_FALSE(FromJson(most + " ", login).ok());
  EXPECT_EQ(login.token().size(), most.size() - begin.size() - end.size());
  EXPECT_EQ(JsonOfAnswer(*v1::GetJobRequest::descriptor(), "\xff\xff").status(),
            absl::InternalError("the answer is no GetJobRequest"));
}

TEST(JsonMessages, ErrorsNameTheirField) { EXPECT_EQ(JsonOfStatus(absl::OkStatus()), R"({"code":"OK"})"); }

}  // namespace
}  // namespace weft
