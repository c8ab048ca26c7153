#include "services/server/console/page_files.h"

#include <gtest/gtest.h>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

TEST(PageFiles, AreServedByPathCompressedWhereThatPays) {
  const TempFolder folder;
  WriteBytes(folder / "index.html", "<!doctype html>" + std::string(2000, 'x'));
  WriteBytes(folder / "assets/main-1a2b3c4d.js", "1;");
  const auto files = LoadPageFiles(folder.path());
  ASSERT_TRUE(files.ok()) << files.status();
  ASSERT_TRUE(files->contains("/"));
  const PageFile& page = files->at("/");
  EXPECT_FALSE(page.is_hashed);
  EXPECT_LT(page.gzip.size(), page.bytes.size() / 10);
  const PageFile& script = files->at("/assets/main-1a2b3c4d.js");
  EXPECT_TRUE(script.is_hashed);
  EXPECT_TRUE(script.gzip.empty());
  EXPECT_NE(script.tag, page.tag);
  EXPECT_EQ(ContentType("a.js"), "text/javascript; charset=utf-8");
  EXPECT_EQ(ContentType("a.ply"), "application/octet-stream");
}

TEST(PageFiles, AFolderWithoutPagesIsSaid) {
  const TempFolder folder;
  const auto files = LoadPageFiles(folder.path());
  EXPECT_EQ(files.status().code(), absl::StatusCode::kNotFound);
  EXPECT_NE(files.status().message().find("index.html"), std::string::npos);
}

}  // namespace
}  // namespace weft
