#include "services/server/console/page_files.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <filesystem>

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

TEST(PageFiles, HaveTypesByTheirEndings) {
  const std::pair<const char*, const char*> kTypes[] = {{"a.html", "text/html; charset=utf-8"},
                                                        {"a.css", "text/css; charset=utf-8"},
                                                        {"a.json", "application/json"},
                                                        {"a.svg", "image/svg+xml"},
                                                        {"a.png", "image/png"},
                                                        {"a.jpg", "image/jpeg"},
                                                        {"a.wasm", "application/wasm"},
                                                        {"a.csv", "text/csv; charset=utf-8"},
                                                        {"a.txt", "text/plain; charset=utf-8"},
                                                        {"html", "application/octet-stream"}};
  for (const auto& [name, type] : kTypes) EXPECT_EQ(ContentType(name), type) << name;
}

TEST(PageFiles, AreCompressedFromHalfAKibibyteOn) {
  const TempFolder folder;
  WriteBytes(folder / "index.html", std::string(511, 'x'));
  WriteBytes(folder / "a/large.txt", std::string(512, 'x'));
  WriteBytes(folder / "a/picture.png", std::string(5000, 'x'));
  std::string noise(600, ' ');
  uint32_t state = 1;
  for (char& c : noise) c = static_cast<char>((state = state * 1664525 + 1013904223) >> 24);
  WriteBytes(folder / "a/noise.txt", noise);
  const auto files = LoadPageFiles(folder.path());
  ASSERT_TRUE(files.ok()) << files.status();
  EXPECT_EQ(files->size(), 4u);
  EXPECT_TRUE(files->at("/").gzip.empty());
  EXPECT_FALSE(files->at("/a/large.txt").gzip.empty());
  EXPECT_TRUE(files->at("/a/picture.png").gzip.empty()) << "it is compressed already";
  EXPECT_TRUE(files->at("/a/noise.txt").gzip.empty()) << "that would make it larger";
  EXPECT_EQ(files->at("/a/noise.txt").bytes, noise);
  EXPECT_EQ(files->at("/").type, "text/html; charset=utf-8");
  // By sha256sum.
  WriteBytes(folder / "index.html", "abc");
  EXPECT_EQ(LoadPageFiles(folder.path())->at("/").tag, "\"ba7816bf8f01cfea\"");
}

TEST(PageFiles, AreGzipForBrowsers) {
  const TempFolder folder;
  const std::string text(3000, 'y');
  WriteBytes(folder / "index.html", text);
  const std::string gzip = LoadPageFiles(folder.path())->at("/").gzip;
  z_stream stream = {};
  ASSERT_EQ(inflateInit2(&stream, 15 + 16), Z_OK);  // gzip alone
  std::string out(4000, ' ');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(gzip.data()));
  stream.avail_in = static_cast<uInt>(gzip.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  inflateEnd(&stream);
  EXPECT_EQ(out, text);
}

TEST(PageFiles, AreNoFolderOfPictures) {
  const TempFolder folder;
  WriteBytes(folder / "index.html", "");
  WriteBytes(folder / "a", "");
  WriteBytes(folder / "b", "1");
  std::filesystem::resize_file(folder / "a", size_t{32} << 20);
  EXPECT_EQ(LoadPageFiles(folder.path()).status(),
            absl::InvalidArgumentError(folder.path() + ": more than 32 MiB are no pages of the console"));
}

}  // namespace
}  // namespace weft
