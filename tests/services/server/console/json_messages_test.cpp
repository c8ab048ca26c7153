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

}  // namespace
}  // namespace weft
