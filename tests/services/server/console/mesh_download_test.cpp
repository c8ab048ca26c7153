// Meshes of jobs for pages that draw them.
#include "services/server/console/mesh_download.h"

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "services/formats/files/mesh_file.h"
#include "services/server/console/quantized_mesh.h"
#include "tests/services/server/console/console_fixture.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// Roles and errors are those of FetchResult, whose bytes they come from.
TEST_F(ConsoleTest, MeshesAreSentToBeDrawn) {
  EXPECT_THAT(Get("/mesh/any/0000"), StartsWith("HTTP/1.1 401"));
  LogIn(TokenOf(v1::ROLE_VIEWER));
  const std::string id = client_->Submit(MakeRequest({"a", "b"})).value().id();
  EXPECT_EQ(WaitForEnd(id).state(), v1::JOB_STATE_DONE);
  RegisteredMesh mesh;
  mesh.vertices_mm = {{0, 0, 900}, {100, 0, 900}, {0, 100, 900}};
  mesh.state = {VertexState::kObserved, VertexState::kTwoView, VertexState::kInferred};
  mesh.sigma_mm = {0.1f, 0.2f, 0.3f};
  mesh.views = {3, 2, 0};
  std::filesystem::create_directories(folder_ / "out/a");
  ASSERT_TRUE(WriteRegisteredMesh(folder_ / "out/a/mesh.ply", mesh, {{0, 1, 2}}).ok());
  const std::string plain = Get(absl::StrCat("/mesh/", id, "/a"));
  EXPECT_THAT(plain, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(plain, HasSubstr("weftmsh1"));
  EXPECT_GT(Get(absl::StrCat("/mesh/", id, "/a?faces=1")).size(), plain.size());
  const std::string none = Get(absl::StrCat("/mesh/", id, "/b"));
  EXPECT_THAT(none, StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(none, HasSubstr("no mesh.ply; is it finished?"));
  WriteBytes(folder_ / "out/b/mesh.ply", "ply\nformat ascii 1.0\nend_header\n");
  EXPECT_THAT(Get(absl::StrCat("/mesh/", id, "/b")), HasSubstr("register the frame again"));
  for (const char* wrong : {"/mesh/a", "/mesh/none/a", "/mesh/a/b/c"})
    EXPECT_THAT(Get(wrong), StartsWith("HTTP/1.1 404")) << wrong;
  // Bytes are those of the file, quantised.
  const std::string ply = ReadBytes(folder_ / "out/a/mesh.ply");
  std::filesystem::copy_file(folder_ / "out/a/mesh.ply", folder_ / "out/a/left.ply");
  EXPECT_EQ(Parsed(plain).body, QuantizedMesh(ply, false, "m").value());
  EXPECT_EQ(Parsed(plain).headers.at("Content-Type"), "application/octet-stream");
  EXPECT_EQ(Parsed(Get(absl::StrCat("/mesh/", id, "/a?faces=1&mesh=left"))).body,
            QuantizedMesh(ply, true, "m").value());
  EXPECT_EQ(Parsed(Get("/mesh/a")).body, R"({"code":"NOT_FOUND","message":"a mesh is at /mesh/JOB/FRAME"})");
  const auto error_of = [&](const std::string& bytes, const std::string& query = "") {
    WriteBytes(folder_ / "out/b/mesh.ply", bytes);
    const Reply reply = Parsed(Get(absl::StrCat("/mesh/", id, "/b", query)));
    EXPECT_EQ(reply.status, "HTTP/1.1 500 Internal Server Error");
    return reply.body;
  };
  const std::string begin = absl::StrCat(R"({"code":"DATA_LOSS","message":"mesh.ply of )", id, "/b: ");
  const std::string remedy = "; register the frame again to replace its mesh\"}";
  EXPECT_EQ(error_of(ply.substr(0, 30)), begin + "it is cut off\"}");
  EXPECT_EQ(error_of(ply.substr(0, ply.size() - 40)), begin + "the vertices are cut off" + remedy);
  EXPECT_EQ(error_of(ply.substr(0, ply.size() - 1), "?faces=1"),
            begin + "face 0 is cut off or names no vertex" + remedy);
}

}  // namespace
}  // namespace weft
