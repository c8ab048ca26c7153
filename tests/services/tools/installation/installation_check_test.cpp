#include "services/tools/installation/installation_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/formats/files/json_file.h"
#include "services/server/access/access_list.h"
#include "tests/services/server/access/certificate_maker.h"
#include "tests/services/tools/client/answering_daemon.h"
#include "tests/services/tools/installation/installed_programs.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

int64_t Now_ns() { return std::chrono::system_clock::now().time_since_epoch().count(); }

class InstallationCheck : public ::testing::Test {
 protected:
  // Findings whose subjects begin so: "subject: GOOD found", "subject: BAD found -> remedy".
  std::vector<std::string> Findings(const std::string& subject) {
    v1::DoctorReport report;
    ExamineInstallation({programs_.path(), config_file_, server_}, report);
    std::vector<std::string> lines;
    for (const v1::DoctorFinding& finding : report.findings()) {
      if (finding.subject().find(subject) != 0) continue;
      std::string line = absl::StrCat(
          finding.subject(), ": ", v1::DoctorVerdict_Name(finding.verdict()).substr(sizeof "DOCTOR_VERDICT"),
          " ", finding.found());
      if (!finding.remedy().empty()) absl::StrAppend(&line, " -> ", finding.remedy());
      lines.push_back(line);
    }
    return lines;
  }
  void Configure(const std::string& text) {
    WriteBytes(programs_.config(), text);
    config_file_ = programs_.config();
  }
  // A state folder as the daemon makes it.
  std::string State() {
    const std::string state = folder_ / "state";
    fs::create_directories(state);
    chmod(state.c_str(), 0700);
    return state;
  }

  InstalledPrograms programs_;
  const TempFolder folder_;
  std::string config_file_, server_;
};

TEST_F(InstallationCheck, ProgramsAreThereAndOfOneVersion) {
  EXPECT_THAT(Findings("program"), ElementsAre("program weftd: GOOD weftd " WEFT_VERSION,
                                               "program weft-worker: GOOD weft-worker " WEFT_VERSION,
                                               "program weft-recorder: GOOD weft-recorder " WEFT_VERSION,
                                               "program weft-video: GOOD weft-video " WEFT_VERSION));
  programs_.Put("weftd", "weftd 0.0.9");
  fs::remove(programs_.path() + "/weft-worker");
  const std::vector<std::string> found = Findings("program");
  ASSERT_EQ(found.size(), 4u);
  EXPECT_EQ(found[0], "program weftd: BAD " + programs_.path() +
                          "/weftd is \"weftd 0.0.9\", this is weft " WEFT_VERSION
                          " -> install all programs from one package, and restart the daemon");
  EXPECT_THAT(found[1], StartsWith("program weft-worker: BAD " + programs_.path() + "/weft-worker: "));
  EXPECT_THAT(found[1], HasSubstr(" -> install the whole package again"));
}

TEST_F(InstallationCheck, FfmpegIsLookedForInThePath) {
  const std::string before = getenv("PATH");
  const std::string program = folder_ / "here/ffmpeg";
  WriteBytes(program, "#!/bin/sh\n");
  fs::create_directories(folder_ / "empty");
  setenv("PATH", ((folder_ / "empty") + "::" + (folder_ / "here")).c_str(), 1);
  EXPECT_THAT(
      Findings("ffmpeg"),
      ElementsAre("ffmpeg: WARNING is not installed: no archives and no videos -> `apt install ffmpeg`"));
  chmod(program.c_str(), 0755);
  EXPECT_THAT(Findings("ffmpeg"), ElementsAre("ffmpeg: GOOD " + program));
  unsetenv("PATH");
  EXPECT_THAT(Findings("ffmpeg"), ElementsAre(StartsWith("ffmpeg: WARNING ")));
  setenv("PATH", before.c_str(), 1);
}

// All tests of files within their folder need openat2.
TEST_F(InstallationCheck, TheKernelIsLookedAt) {
  EXPECT_THAT(Findings("kernel"),
              ElementsAre("kernel openat2: GOOD there",
                          AnyOf(testing::MatchesRegex("kernel Landlock: GOOD version [1-9][0-9]*"),
                                "kernel Landlock: WARNING missing: workers are not confined by "
                                "the kernel -> Linux 5.13 or newer with `lsm=...,landlock` on "
                                "the kernel's command line")));
}

// In a process of its own: whoever gives up descriptors does not get them back.
TEST_F(InstallationCheck, FewDescriptorsAreWarnedOf) {
  const auto found_with = [this](rlim_t most) {
    const rlimit limit{most, most};
    EXPECT_EQ(setrlimit(RLIMIT_NOFILE, &limit), 0);
    fprintf(stderr, "%s\n", Findings("descriptors").at(0).c_str());
    _exit(0);
  };
  EXPECT_EXIT(
      found_with(1299), ::testing::ExitedWithCode(0),
      "descriptors: WARNING at most 1299 open files: a daemon that is started here takes fewer connections "
      "-> `ulimit -Hn 65536`, or LimitNOFILE of the service");
  EXPECT_EXIT(found_with(1300), ::testing::ExitedWithCode(0), "descriptors: GOOD at most 1300 open files\n");
}

TEST_F(InstallationCheck, TheConfigurationIsReadByTheDaemonItself) {
  EXPECT_THAT(Findings("configuration"), IsEmpty());
  EXPECT_THAT(Findings("daemon"), IsEmpty()) << "nobody says where";
  Configure("state: \"/nowhere\" listen: \"127.0.0.1:1\"");
  EXPECT_THAT(Findings("configuration"), ElementsAre("configuration: GOOD " + config_file_));
  EXPECT_THAT(Findings("state"), IsEmpty()) << "it is not of this machine";
  Configure("no options");
  EXPECT_THAT(
      Findings("configuration"),
      ElementsAre("configuration: BAD " + config_file_ +
                  ": weftd prints what weft does not read; are they of one version? -> mend it; a daemon "
                  "that runs keeps its old settings until then"));
  programs_.Put("weftd", "weftd " WEFT_VERSION, 1);
  EXPECT_THAT(Findings("configuration"), ElementsAre(HasSubstr("exit status 1")));
}

TEST_F(InstallationCheck, ADaemonIsAskedForVersionClockAndWarnings) {
  AnsweringDaemon daemon;
  server_ = daemon.address();
  daemon.info.told.set_version(WEFT_VERSION);
  daemon.info.told.set_jobs_running(2);
  daemon.info.told.set_jobs_queued(3);
  daemon.info.told.set_unix_ns(Now_ns());
  EXPECT_THAT(Findings("daemon"),
              ElementsAre("daemon: GOOD weftd " WEFT_VERSION " at " + server_ + ", 2 jobs run, 3 wait"));
  daemon.info.told.set_version("0.0.9");
  daemon.info.told.add_warnings("the disk is nearly full");
  daemon.info.told.set_unix_ns(Now_ns() + 100'000'000'000);
  std::vector<std::string> found = Findings("daemon");
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0], "daemon: BAD weftd at " + server_ +
                          " is 0.0.9, this is weft " WEFT_VERSION
                          " -> `weft daemon drain`, then start the daemon again");
  EXPECT_EQ(found[1],
            "daemon: WARNING the disk is nearly full -> see Troubleshooting in docs/guide/daemon-upkeep.md");
  EXPECT_THAT(found[2],
              testing::MatchesRegex("daemon's clock: WARNING differs from this machine's by (99|100).[0-9] s "
                                    "-> run chrony on both machines"));
  daemon.info.told.set_unix_ns(Now_ns() - 2'000'000'000);
  EXPECT_THAT(Findings("daemon's clock"), ElementsAre(HasSubstr(" by -2.")));
}

TEST_F(InstallationCheck, ADaemonThatDoesNotAnswerIsBadAndAStrangerIsWarned) {
  server_ = "127.0.0.1:1";
  std::vector<std::string> found = Findings("daemon");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_THAT(found[0], StartsWith("daemon: BAD no daemon answers at 127.0.0.1:1"));
  EXPECT_THAT(found[0], HasSubstr(" -> `systemctl status weftd` and `journalctl -u weftd` say why"));
  AnsweringDaemon daemon;
  // The configuration's first address is asked where no other is named.
  server_.clear();
  Configure("listen: \"" + daemon.address() + "\" listen: \"127.0.0.1:1\"");
  EXPECT_THAT(Findings("daemon: "), IsEmpty());
  EXPECT_THAT(Findings("daemon"), Contains(StartsWith("daemon: BAD weftd at " + daemon.address())));
  daemon.info.knows_client = grpc::Status(grpc::StatusCode::UNAUTHENTICATED, "who are you?");
  EXPECT_THAT(
      Findings("daemon"),
      ElementsAre("daemon: WARNING who are you? -> name a token by WEFT_TOKEN_FILE, or look as the daemon's "
                  "user"));
}

TEST_F(InstallationCheck, TheStateIsForItsOwnerAloneAndHasRoom) {
  const std::string state = State();
  Configure("state: \"" + state + "\"");
  const fs::space_info space = fs::space(state);
  std::vector<std::string> found = Findings("state");
  ASSERT_EQ(found.size(), 1u);
  const double free_gb = static_cast<double>(space.available) / 1e9;
  const std::string verdict = free_gb < 1 ? "BAD" : free_gb < 10 ? "WARNING" : "GOOD";
  EXPECT_THAT(found[0], StartsWith("state " + state + ": " + verdict + " "));
  EXPECT_THAT(found[0], HasSubstr(" GB free"));
  for (const mode_t mode : {0750, 0701}) {
    chmod(state.c_str(), mode);
    found = Findings("state");
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(found[0],
              absl::StrFormat("state %s: BAD mode %03o: other users get at takes, results and leases -> "
                              "`chmod 700 %s`",
                              state, mode, state));
  }
  // A daemon says where its state is, too.
  config_file_.clear();
  AnsweringDaemon daemon;
  server_ = daemon.address();
  daemon.info.told.set_state_folder(state);
  EXPECT_EQ(Findings("state " + state).size(), 2u);
  daemon.info.told.set_state_folder(folder_ / "elsewhere");
  EXPECT_THAT(Findings("state"), IsEmpty());
}

TEST_F(InstallationCheck, CertificatesThatEndSoonAreToldInTime) {
  CertificateMaker maker(folder_.path(), "studio");
  const auto told = [&](const CertificateFiles& files) {
    Configure("tls_cert: \"" + files.certificate + "\"");
    return Findings("certificate");
  };
  const auto remedy = [](const CertificateFiles& files) {
    return " -> renew it in " + files.certificate + "; weftd takes it without a restart";
  };
  const CertificateFiles good = maker.Sign("weftd", 32), soon = maker.Sign("soon", 31),
                         old = maker.Sign("old", 5, "IP:127.0.0.1", -10);
  EXPECT_THAT(told(good), ElementsAre("certificate CN = weftd: GOOD valid for 30 days"));
  EXPECT_THAT(told(soon), ElementsAre("certificate CN = soon: WARNING expires in 29 days" + remedy(soon)));
  EXPECT_THAT(told(old), ElementsAre("certificate CN = old: BAD expired 6 days ago" + remedy(old)));
  Configure("tls_client_ca: \"" + maker.authority() + "\" tls_client_crl: \"" + (folder_ / "none") + "\"");
  const std::vector<std::string> found = Findings("certificate");
  ASSERT_EQ(found.size(), 2u);
  EXPECT_THAT(found[0], StartsWith("certificate CN = studio: "));
  EXPECT_THAT(found[1], StartsWith("certificate " + (folder_ / "none") + ": BAD " + (folder_ / "none")));
  EXPECT_THAT(found[1], HasSubstr(" -> name a PEM file that weftd may read"));
}

TEST_F(InstallationCheck, TokensThatEndSoonAreToldInTime) {
  const std::string state = State(), file = AccessListFile(state);
  Configure("state: \"" + state + "\"");
  EXPECT_THAT(Findings("token"), IsEmpty());
  for (const auto& [name, days] : {std::pair("always", 0.0), {"long", 31.5}, {"soon", 20.5}, {"old", 1.0}})
    ASSERT_TRUE(AddToken(file, {name, v1::ROLE_VIEWER, days}).ok());
  v1::AccessList list = *ReadAccessList(file);
  ASSERT_EQ(list.tokens_size(), 4);
  list.mutable_tokens(3)->set_expires_unix_ns(Now_ns() - 1'000'000);
  ASSERT_TRUE(WriteJsonFile(file, list).ok());
  chmod(file.c_str(), 0600);
  const auto id = [&](int i) { return list.tokens(i).id(); };
  EXPECT_THAT(Findings("token"),
              ElementsAre("token " + id(1) + " of long: GOOD valid for 31 days",
                          "token " + id(2) +
                              " of soon: WARNING expires in 20 days -> `weft access token soon` makes "
                              "the next one",
                          "token " + id(3) + " of old: WARNING has expired -> `weft access revoke " + id(3) +
                              " --state " + state + "`, and make another one if it is missed"));
  WriteBytes(file, "no list");
  EXPECT_THAT(Findings("tokens"), ElementsAre(HasSubstr(" -> nobody is let in by token until it is mended")));
}

TEST_F(InstallationCheck, AsksADaemonAtItsFirstAddress) {
  v1::DaemonConfig config;
  EXPECT_EQ(FirstAddressOf(config), "");
  config.set_state("/var/lib/weft");
  EXPECT_EQ(FirstAddressOf(config), "unix:/var/lib/weft/weftd.sock");
  config.add_listen("studio:7411");
  config.add_listen("unix:/run/weft.sock");
  EXPECT_EQ(FirstAddressOf(config), "studio:7411");
}

TEST_F(InstallationCheck, KnowsWhereThisProgramIs) {
  EXPECT_TRUE(fs::exists(OwnProgramFolder() + "/" + fs::read_symlink("/proc/self/exe").filename().string()));
}

}  // namespace
}  // namespace weft
