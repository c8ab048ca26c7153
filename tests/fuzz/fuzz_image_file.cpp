#include <tiffio.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "capture/image/image_file.h"
#include "capture/image/image_header.h"
#include "pattern/board/board.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

std::string Scratch(const std::string& ending) {
  return (std::filesystem::temp_directory_path() / ("weft_fuzz_image_" + std::to_string(getpid()) + ending))
      .string();
}

struct TiffKind {
  uint16_t photometric;
  int samples;
  bool tiled;
  int planes;
  bool big;
};

// A thumbnail, and the picture in a directory of its own.
std::string Tiff(const TiffKind& kind) {
  const std::string path = Scratch(".tif");
  TIFF* tiff = TIFFOpen(path.c_str(), kind.big ? "w8" : "w");
  for (const int side : {8, 32}) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, side);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, side);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 8);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, kind.samples);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, kind.photometric);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, kind.planes);
    TIFFSetField(tiff, TIFFTAG_ORIENTATION, ORIENTATION_RIGHTTOP);
    TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, side == 8 ? FILETYPE_REDUCEDIMAGE : 0);
    if (kind.photometric == PHOTOMETRIC_CFA) {
      const uint16_t sides[2] = {2, 2};
      const uint8_t colours[4] = {0, 1, 1, 2};
      TIFFSetField(tiff, TIFFTAG_CFAREPEATPATTERNDIM, sides);
      TIFFSetField(tiff, TIFFTAG_CFAPATTERN, 4, colours);
    }
    if (kind.photometric == PHOTOMETRIC_PALETTE) {
      std::vector<uint16_t> ramp(256);
      for (size_t i = 0; i < ramp.size(); ++i) ramp[i] = static_cast<uint16_t>(257 * i);
      TIFFSetField(tiff, TIFFTAG_COLORMAP, ramp.data(), ramp.data(), ramp.data());
    }
    const int planes = kind.planes == PLANARCONFIG_SEPARATE ? kind.samples : 1;
    std::vector<uint8_t> bytes(static_cast<size_t>(32 * 32 * kind.samples), 0x5a);
    if (kind.tiled) {
      TIFFSetField(tiff, TIFFTAG_TILEWIDTH, 32);
      TIFFSetField(tiff, TIFFTAG_TILELENGTH, 32);
    }
    for (int plane = 0; plane < planes; ++plane) {
      if (kind.tiled) TIFFWriteTile(tiff, bytes.data(), 0, 0, 0, static_cast<uint16_t>(plane));
      for (int y = 0; !kind.tiled && y < side; ++y)
        TIFFWriteScanline(tiff, bytes.data(), static_cast<uint32_t>(y), static_cast<uint16_t>(plane));
    }
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
  std::ifstream file(path, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  std::remove(path.c_str());
  return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string path = Scratch("");
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  const auto frame = weft::ReadImageFile(path);
  const auto header = weft::ReadImageFileHeader(path);
  std::remove(path.c_str());
  if (header.ok()) weft::FuzzRequire(header->orientation >= 1 && header->orientation <= 8);
  if (!frame.ok()) return 0;
  weft::FuzzRequire(frame->Validate().ok());
  // The rest of the file does not change what the header says.
  weft::FuzzRequire(header.ok(), std::string(header.status().message()));
  weft::FuzzRequire(header->width_px == frame->width_px && header->height_px == frame->height_px);
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
  for (const TiffKind& kind : {TiffKind{PHOTOMETRIC_RGB, 3, false, PLANARCONFIG_CONTIG, false},
                               TiffKind{PHOTOMETRIC_RGB, 4, true, PLANARCONFIG_CONTIG, false},
                               TiffKind{PHOTOMETRIC_MINISBLACK, 3, false, PLANARCONFIG_SEPARATE, true},
                               TiffKind{PHOTOMETRIC_CFA, 1, true, PLANARCONFIG_CONTIG, false},
                               TiffKind{PHOTOMETRIC_SEPARATED, 4, false, PLANARCONFIG_CONTIG, true},
                               TiffKind{PHOTOMETRIC_PALETTE, 1, true, PLANARCONFIG_CONTIG, false}}) {
    seeds.push_back(Tiff(kind));
  }
  return seeds;
}
