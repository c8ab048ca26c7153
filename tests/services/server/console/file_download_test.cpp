// Files of the API for browsers: whole, in parts, and by which name.
#include "services/server/console/file_download.h"

#include <grpc/grpc.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "tests/services/server/console/console_fixture.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class FileDownloadTest : public ConsoleTest {
 protected:
  FileDownloadTest() {
    // Shut down after a large answer, gRPC waits up to 10 s for a poller of its own; so it stays.
    [[maybe_unused]] static const bool is_kept = (grpc_init(), true);
    LogIn(TokenOf(v1::ROLE_VIEWER));
    job_ = Submit({"a"});
    EXPECT_EQ(WaitForEnd(job_).state(), v1::JOB_STATE_DONE);
    WriteBytes(folder_ / "out/a/observations.csv", "0123456789");
  }
  // Of frame a.
  std::string PathOf(const std::string& kind, const std::string& more = "") const {
    return absl::StrCat("/file/Jobs/FetchResult?job_id=", job_, "&frame=a&kind=RESULT_KIND_", kind, more);
  }
  Reply Fetch(const std::string& kind, const std::string& more = "") const {
    return Parsed(Get(PathOf(kind, more)));
  }
  // A part of observations.csv: status, range and body.
  std::string Part(const std::string& range, const std::string& if_range = "") const {
    const Reply reply = Parsed(
        Get(PathOf("OBSERVATIONS"), absl::StrCat("Range: bytes=", range, "\r\n",
                                                 if_range.empty() ? "" : "If-Range: " + if_range + "\r\n")));
    const auto content = reply.headers.find("Content-Range");
    EXPECT_EQ(reply.headers.at("Content-Length"), absl::StrCat(reply.body.size()));
    return absl::StrCat(reply.status.substr(9, 3), "|", content == reply.headers.end() ? "" : content->second,
                        "|", reply.body);
  }

  std::string job_;
};

TEST_F(FileDownloadTest, FilesComeWholeAndMayDoNothing) {
  const Reply reply = Fetch("OBSERVATIONS");
  EXPECT_EQ(reply.status, "HTTP/1.1 200 OK");
  EXPECT_EQ(reply.body, "0123456789");
  const std::string tag = reply.headers.at("ETag");
  EXPECT_THAT(tag, ::testing::MatchesRegex("\"[^\"]+\""));
  const std::map<std::string, std::string> expected = {
      {"Content-Type", "text/csv; charset=utf-8"},
      {"X-Content-Type-Options", "nosniff"},
      {"Content-Security-Policy",
       "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline'; style-src "
       "'unsafe-inline'; img-src data: blob:; font-src data:; frame-ancestors 'self'"},
      {"Cross-Origin-Resource-Policy", "same-origin"},
      {"Cross-Origin-Opener-Policy", "same-origin"},
      {"Referrer-Policy", "no-referrer"},
      {"Cache-Control", "no-store"},
      {"Accept-Ranges", "bytes"},
      {"ETag", tag},
      {"Content-Length", "10"},
      {"Connection", "close"}};
  EXPECT_EQ(reply.headers, expected);
  const Reply head =
      Parsed(Ask(absl::StrCat("HEAD ", PathOf("OBSERVATIONS"), " HTTP/1.1\r\n", Headers(), "\r\n")));
  EXPECT_EQ(head.headers, expected);
  EXPECT_EQ(head.body, "");
}

TEST_F(FileDownloadTest, PartsAreOfTheSameFile) {
  const std::string tag = Fetch("OBSERVATIONS").headers.at("ETag");
  EXPECT_EQ(Part("0-3"), "206|bytes 0-3/10|0123");
  EXPECT_EQ(Part("0-9"), "206|bytes 0-9/10|0123456789");
  EXPECT_EQ(Part("0-8"), "206|bytes 0-8/10|012345678");
  EXPECT_EQ(Part("0-"), "206|bytes 0-9/10|0123456789");
  EXPECT_EQ(Part("4-6", tag), "206|bytes 4-6/10|456");
  EXPECT_EQ(Part("9-9", tag), "206|bytes 9-9/10|9");
  EXPECT_EQ(Part("4-", tag), "206|bytes 4-9/10|456789");
  EXPECT_EQ(Part("1-999", tag), "206|bytes 1-9/10|123456789");
  // Nobody knows whether the rest is of the same file.
  for (const std::string& none : {std::string(), "W/" + tag, std::string("\""), std::string("x")})
    EXPECT_EQ(Part("4-6", none), "200||0123456789") << none;
  EXPECT_EQ(Part("x"), "200||0123456789");
  EXPECT_THAT(Part("4-6", "\"another\""), StartsWith("409||{\"code\":\"ABORTED\""));
  EXPECT_THAT(Part("11-", tag), StartsWith("416||{\"code\":\"OUT_OF_RANGE\""));
}

TEST_F(FileDownloadTest, LargeFilesArriveWhole) {
  std::string mesh(1'500'000, 'm');
  for (size_t i = 0; i < mesh.size(); ++i) mesh[i] = static_cast<char>(i * 2654435761u >> 24);
  WriteBytes(folder_ / "out/a/mesh.ply", mesh);
  const Reply reply = Fetch("MESH");
  EXPECT_TRUE(reply.body == mesh);
  EXPECT_EQ(reply.headers.at("Content-Disposition"), "attachment; filename=\"mesh.ply\"");
  EXPECT_TRUE(Parsed(Get(PathOf("MESH"), "Range: bytes=0-1000000\r\n")).body == mesh.substr(0, 1'000'001));
  EXPECT_TRUE(Parsed(Get(PathOf("MESH"), absl::StrCat("Range: bytes=700000-1400000\r\nIf-Range: ",
                                                      reply.headers.at("ETag"), "\r\n")))
                  .body == mesh.substr(700'000, 700'001));
}

TEST_F(FileDownloadTest, FilesHaveTheirNamesAndTypes) {
  for (const char* name :
       {"a/left.ply", "a/mesh.ply", "a/cloud.ply", "a/cloud.pcd", "a/report.json", "report.html"})
    WriteBytes(folder_ / absl::StrCat("out/", name), "");
  // Type, and the name where it is saved.
  const auto shown = [this](const std::string& kind, const std::string& more = "") {
    const Reply reply = Fetch(kind, more);
    EXPECT_EQ(reply.status, "HTTP/1.1 200 OK") << kind << reply.body;
    const auto saved = reply.headers.find("Content-Disposition");
    return absl::StrCat(reply.headers.at("Content-Type"), "|",
                        saved == reply.headers.end() ? "" : saved->second);
  };
  const std::string as = "application/octet-stream|attachment; filename=";
  EXPECT_EQ(shown("MESH", "&mesh=left"), as + "\"left.ply\"");
  EXPECT_EQ(shown("MESH"), as + "\"mesh.ply\"");
  EXPECT_EQ(shown("CLOUD"), as + "\"cloud.ply\"");
  EXPECT_EQ(shown("CLOUD_PCD"), as + "\"file\"");
  EXPECT_EQ(shown("FRAME_REPORT"), "application/json|");
  EXPECT_EQ(shown("OBSERVATIONS", "&save_as=my%20%22file%22-1.csv"),
            "text/csv; charset=utf-8|attachment; filename=\"my__file_-1.csv\"");
  EXPECT_EQ(shown("CLOUD", "&save_as=" + std::string(120, 'n')), as + "\"" + std::string(100, 'n') + "\"");
  const std::string of_job = absl::StrCat("/file/Jobs/FetchResult?job_id=", job_, "&kind=RESULT_KIND_JOB");
  EXPECT_EQ(Parsed(Get(of_job + "_REPORT")).headers.at("Content-Type"), "text/html; charset=utf-8");
  EXPECT_EQ(Parsed(Get(of_job)).headers.at("Content-Type"), "application/json");
}

TEST_F(FileDownloadTest, OtherRequestsAreRefused) {
  const std::string none =
      R"({"code":"UNIMPLEMENTED","message":"there is no such method that sends a file"})";
  for (const char* path : {"/file/Jobs/GetJob?job_id=a", "/file/Jobs/WatchJob?job_id=a", "/file/x"}) {
    EXPECT_THAT(Get(path), StartsWith("HTTP/1.1 404")) << path;
    EXPECT_EQ(Parsed(Get(path)).body, none) << path;
  }
  EXPECT_EQ(Parsed(Get("/file/Jobs/FetchResult?color=red")).body,
            R"({"code":"INVALID_ARGUMENT","message":"color: \"red\" is no value of FetchResultRequest"})");
  EXPECT_THAT(Get("/file/Jobs/FetchResult?job_id=none&kind=RESULT_KIND_JOB"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(Fetch("CLOUD").body, HasSubstr("\"code\":\"NOT_FOUND\""));
  cookie_.clear();
  EXPECT_THAT(Get(PathOf("OBSERVATIONS")), StartsWith("HTTP/1.1 401"));
}

}  // namespace
}  // namespace weft
