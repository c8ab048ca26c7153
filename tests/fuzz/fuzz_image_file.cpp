#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "capture/image/image_file.h"
#include "pattern/board/board.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

std::string Scratch(const std::string& ending) {
  return (std::filesystem::temp_directory_path() / ("weft_fuzz_image_" + std::to_string(getpid()) + ending))
      .string();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string path = Scratch("");
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  const auto frame = weft::ReadImageFile(path);
  std::remove(path.c_str());
  if (!frame.ok()) return 0;
  weft::FuzzRequire(frame->Validate().ok());
  const auto board = weft::BoardFromImage(*frame);
  if (board.ok()) weft::FuzzRequire(board->Validate().ok());
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  const auto board = GenerateBoard(8, 8, 2.0, 1);
  FuzzRequire(board.ok());
  std::vector<std::string> seeds;
  for (const char* ending : {".png", ".jpg", ".tif"}) {
    const std::string path = Scratch(ending);
    FuzzRequire(WriteImageFile(path, BoardToImage(*board)).ok());
    std::ifstream file(path, std::ios::binary);
    seeds.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    std::remove(path.c_str());
  }
  return seeds;
}
