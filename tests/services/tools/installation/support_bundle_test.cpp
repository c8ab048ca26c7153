#include "services/tools/installation/support_bundle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "services/formats/files/json_file.h"
#include "services/server/access/access_list.h"
#include "services/server/catalogue/job_records.h"
#include "tests/services/tools/client/answering_daemon.h"
#include "tests/services/tools/installation/installed_programs.h"
#include "weft/v1/sessions.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class SupportBundle : public ::testing::Test {
 protected:
  SupportBundle() {
    for (const char* variable : {"WEFT_TOKEN_FILE", "WEFT_TLS_KEY"}) unsetenv(variable);
    options_.installation.program_folder = programs_.path();
    options_.out = folder_ / "support.tar.gz";
    options_.journal_lines = 3;
  }
  // The texts of the bundle are in files afterwards.
  std::vector<std::string> Write() {
    const auto names = WriteSupportBundle(options_);
    EXPECT_TRUE(names.ok()) << names.status();
    fs::remove_all(folder_ / "weft-support");
    EXPECT_EQ(std::system(("cd '" + folder_.path() + "' && tar -xzf '" + options_.out + "'").c_str()), 0);
    return names.ok() ? *names : std::vector<std::string>();
  }
  std::string Text(const std::string& name) const { return ReadBytes(folder_ / ("weft-support/" + name)); }
  void Configure(const std::string& text) {
    WriteBytes(programs_.config(), text);
    options_.installation.config_file = programs_.config();
  }

  InstalledPrograms programs_;
  const TempFolder folder_;
  SupportOptions options_;
};

TEST_F(SupportBundle, HasTextsOfTheMachineWhereThereIsNoDaemon) {
  EXPECT_THAT(Write(), ElementsAre("doctor.txt", "journal.txt", "machine.txt", "versions.txt"));
  EXPECT_THAT(Text("versions.txt"),
              StartsWith("weft " WEFT_VERSION "\nweftd " WEFT_VERSION "\nweft-worker " WEFT_VERSION
                         "\nweft-recorder " WEFT_VERSION "\nweft-video " WEFT_VERSION "\n"));
  EXPECT_THAT(Text("doctor.txt"), HasSubstr("program weftd"));
  EXPECT_THAT(Text("machine.txt"), StartsWith("Linux "));
  const std::string release = ReadBytes("/etc/os-release");
  EXPECT_THAT(Text("machine.txt"), HasSubstr("\n\n" + release.substr(0, release.find('\n'))));
  struct stat file = {};
  ASSERT_EQ(stat(options_.out.c_str(), &file), 0);
  EXPECT_EQ(file.st_mode & 0777, 0600u);
}

TEST_F(SupportBundle, IsPackedAsItsNameSays) {
  options_.out = folder_ / "support.tar.zst";
  ASSERT_TRUE(WriteSupportBundle(options_).ok());
  EXPECT_THAT(ReadBytes(options_.out), StartsWith("\x28\xB5\x2F\xFD"));
  options_.out = folder_ / "support.zip";
  EXPECT_EQ(WriteSupportBundle(options_).status(),
            absl::InvalidArgumentError("--out: " + options_.out + ": must end in .tar.zst or .tar.gz"));
  options_.out = folder_ / "none/support.tar.gz";
  EXPECT_FALSE(WriteSupportBundle(options_).ok());
}

TEST_F(SupportBundle, SaysWhatADaemonDoes) {
  AnsweringDaemon daemon;
  options_.installation.server = daemon.address();
  daemon.info.told.add_warnings("the disk is nearly full");
  daemon.jobs.list = [](const v1::ListJobsRequest& request, v1::ListJobsResponse* out) {
    EXPECT_EQ(request.limit(), 1000);
    out->add_jobs()->set_id("j1");
    return grpc::Status::OK;
  };
  EXPECT_THAT(Write(), ElementsAre("doctor.txt", "jobs.json", "journal.txt", "machine.txt", "operations.json",
                                   "server.json", "takes.json", "versions.txt"));
  v1::ServerInfo info;
  ASSERT_TRUE(ParseJson(Text("server.json"), "server.json", info).ok());
  EXPECT_EQ(info.warnings(0), "the disk is nearly full");
  v1::ListJobsResponse jobs;
  ASSERT_TRUE(ParseJson(Text("jobs.json"), "jobs.json", jobs).ok());
  EXPECT_EQ(jobs.jobs(0).id(), "j1");
  EXPECT_THAT(Text("takes.json"), StartsWith("not there: "));
  EXPECT_THAT(Text("operations.json"), StartsWith("not there: "));
  EXPECT_THAT(Text("doctor.txt"), HasSubstr("the disk is nearly full"));
  options_.installation.server = "127.0.0.1:1";
  Write();
  EXPECT_THAT(Text("server.json"), StartsWith("not there: no daemon answers at 127.0.0.1:1"));
}

TEST_F(SupportBundle, ListsTheStateAndItsCatalogue) {
  const std::string state = folder_ / "state";
  WriteBytes(state + "/jobs/j1/0001/mesh.ply", "abc");
  WriteBytes(state + "/jobs/j1/job.json", "{}");
  WriteBytes(state + "/a", std::string(1234, 'x'));
  chmod((state + "/a").c_str(), 0640);
  for (const char* folder : {"/jobs", "/jobs/j1", "/jobs/j1/0001"}) chmod((state + folder).c_str(), 0700);
  chmod((state + "/jobs/j1/job.json").c_str(), 0600);
  Configure("state: \"" + state + "\"");
  EXPECT_THAT(Write(), ElementsAre("catalogue.txt", "config.txtpb", "doctor.txt", "journal.txt",
                                   "machine.txt", "server.json", "state.txt", "versions.txt"));
  EXPECT_EQ(Text("config.txtpb"), "state: \"" + state + "\"");
  EXPECT_EQ(Text("catalogue.txt"), state + "/catalogue.sqlite: 0 records of jobs, all whole\n");
  const std::string listed = Text("state.txt");
  EXPECT_THAT(listed, HasSubstr("640           1234  a\n"));
  EXPECT_THAT(listed, HasSubstr("700              0  jobs/j1\n"));
  EXPECT_THAT(listed, HasSubstr("600              2  jobs/j1/job.json\n"));
  EXPECT_THAT(listed, HasSubstr("700              0  jobs/j1/0001\n"));
  EXPECT_THAT(listed, HasSubstr("  jobs/j1/0001/mesh.ply\n")) << "three folders deep";
  v1::JobUpdate record;
  record.mutable_job()->set_id("j1");
  ASSERT_TRUE(JobRecords(state + "/catalogue.sqlite").Write(record).ok());
  Write();
  EXPECT_EQ(Text("catalogue.txt"), state + "/catalogue.sqlite: 1 records of jobs, all whole\n");
  WriteBytes(state + "/catalogue.sqlite.jobs/j1", "damaged");
  Write();
  EXPECT_THAT(Text("catalogue.txt"), HasSubstr("j1"));
  EXPECT_THAT(Text("catalogue.txt"), Not(HasSubstr("all whole")));
  Configure("state: \"" + (folder_ / "none") + "\"");
  Write();
  EXPECT_THAT(Text("state.txt"), StartsWith("not there: "));
}

TEST_F(SupportBundle, HasNoSecrets) {
  const std::string state = folder_ / "state";
  v1::CaptureSession session;
  session.set_lease("lease-of-a-session");
  fs::create_directories(state + "/sessions");
  ASSERT_TRUE(WriteJsonFile(state + "/sessions/s1", session).ok());
  const auto token = AddToken(AccessListFile(state), {"anna", v1::ROLE_VIEWER, 0});
  ASSERT_TRUE(token.ok()) << token.status();
  WriteBytes(folder_ / "key", "-----BEGIN-----\nkey-of-the-daemon\n");
  WriteBytes(folder_ / "hook", "secret-of-the-hook");
  WriteBytes(folder_ / "token", "token-of-this-user");
  WriteBytes(folder_ / "own key", "key-of-this-user");
  setenv("WEFT_TOKEN_FILE", (folder_ / "token").c_str(), 1);
  setenv("WEFT_TLS_KEY", (folder_ / "own key").c_str(), 1);
  const std::string secrets = absl::StrCat("lease-of-a-session ", token->token.sha256(),
                                           " key-of-the-daemon secret-of-the-hook "
                                           "token-of-this-user key-of-this-user part-of-the-url");
  Configure("state: \"" + state + "\" tls_key: \"" + (folder_ / "key") + "\" on_end_secret: \"" +
            (folder_ / "hook") + "\" on_end_url: \"https://hooks.example/part-of-the-url\"\n# " + secrets +
            "\n");
  Write();
  unsetenv("WEFT_TOKEN_FILE");
  unsetenv("WEFT_TLS_KEY");
  EXPECT_THAT(Text("config.txtpb"),
              testing::EndsWith("\n# [redacted] [redacted] [redacted] [redacted] [redacted] "
                                "[redacted] [redacted]\n"));
}

TEST_F(SupportBundle, SaysWhatCannotBeHad) {
  programs_.Put("weftd", "broken", 1);
  fs::remove(programs_.path() + "/weft-video");
  Configure("state: \"/nowhere\"");
  EXPECT_THAT(Write(),
              ElementsAre("config.txtpb", "doctor.txt", "journal.txt", "machine.txt", "versions.txt"));
  EXPECT_THAT(Text("config.txtpb"), StartsWith("not there: "));
  EXPECT_THAT(Text("versions.txt"), HasSubstr("not there: " + programs_.path() + "/weft-video"));
}

}  // namespace
}  // namespace weft
