// The reader of streams and indexes, on files whose checksums are made right again after each mutation, so
// that everything behind them is reached too.
#include <sys/mman.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <string>

#include "capture/file/checksum.h"
#include "capture/take/frame_codec.h"
#include "capture/take/recorded_take.h"
#include "capture/take/take_files.h"
#include "capture/take/take_format.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

namespace fs = std::filesystem;
using weft::kBlockBytes;
using weft::kIndexRecordBytes;

// A folder streams/ whose two files live in memory.
class StreamFiles {
 public:
  StreamFiles() : folder_(fs::temp_directory_path() / ("weft_fuzz_take_" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
    Link(stream_, weft::StreamFile(folder_.string(), "cam"));
    Link(index_, weft::IndexFile(folder_.string(), "cam"));
  }
  ~StreamFiles() { fs::remove_all(folder_); }

  void Fill(const std::string& stream, const std::string& index) const {
    Fill(stream_, stream);
    Fill(index_, index);
  }
  std::string folder() const { return folder_.string(); }

 private:
  static void Link(int fd, const std::string& name) {
    fs::remove(name);
    fs::create_symlink("/proc/self/fd/" + std::to_string(fd), name);
  }
  static void Fill(int fd, const std::string& bytes) {
    weft::FuzzRequire(ftruncate(fd, 0) == 0);
    weft::FuzzRequire(pwrite(fd, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size()));
  }

  const fs::path folder_;
  const int stream_ = memfd_create("stream", 0);
  const int index_ = memfd_create("index", 0);
};

void Seal(std::string& bytes, size_t first, size_t size) {
  const uint64_t checksum = weft::Checksum(bytes.data() + first, size - 8);
  std::memcpy(bytes.data() + first + size - 8, &checksum, 8);
}

// Blocks are given short in the inputs, since most of a header is zero: 200 bytes, then up to one block of
// payload.
constexpr size_t kShortBytes = 200;

std::string StreamOf(const std::string& input) {
  std::string stream;
  for (size_t at = 0; at < input.size(); at += kShortBytes) {
    const std::string block = input.substr(at, kShortBytes);
    const size_t first = stream.size();
    stream += block;
    stream.resize(first + kBlockBytes, '\0');
    if (block.compare(0, 4, "WEFT") == 0) Seal(stream, first, kBlockBytes);
  }
  return stream;
}

}  // namespace

// Input: a byte that says what to make right, the length of the stream's part (16 bits), stream, index.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const StreamFiles files;
  if (size < 3) return 0;
  const std::string input(reinterpret_cast<const char*>(data + 3), size - 3);
  const size_t cut = std::min(input.size(), static_cast<size_t>(data[1] | data[2] << 8));
  std::string index = input.substr(cut);
  if (data[0] & 1) {
    for (size_t at = 0; at + kIndexRecordBytes <= index.size(); at += kIndexRecordBytes)
      Seal(index, at, kIndexRecordBytes);
  }
  files.Fill(StreamOf(input.substr(0, cut)), index);
  const auto reader = weft::StreamReader::OpenDamaged(files.folder(), "cam", data[0] & 2 ? 9 : 0);
  if (!reader.ok()) return 0;
  for (const weft::IndexRecord& record : (*reader)->records()) {
    const auto frame = (*reader)->Read(record);
    if (!frame.ok()) continue;
    weft::FuzzRequire(frame->bytes->size() > 0 && weft::IsRawFormat(static_cast<uint32_t>(frame->format)));
    weft::FuzzRequire(frame->width_px > 0 && frame->height_px > 0);
  }
  const auto scan = (*reader)->Scan();
  weft::FuzzRequire(scan.ok() && scan->end_bytes <= std::max<uint64_t>(scan->file_bytes, kBlockBytes));
  uint64_t before = 0;
  for (const weft::IndexRecord& record : scan->records) {
    weft::FuzzRequire(record.offset_bytes > before);
    before = record.offset_bytes;
    const auto frame = (*reader)->Read(record);
    weft::FuzzRequire(frame.ok() || absl::IsNotFound(frame.status()) || absl::IsDataLoss(frame.status()));
  }
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  std::string blocks(kShortBytes * 7, '\0'), index = IndexHeader(9);
  std::string block(kBlockBytes, '\0');
  auto* at = reinterpret_cast<uint8_t*>(block.data());
  WriteBlock(StreamHeader{9, "cam", ""}, at);
  blocks.replace(0, kShortBytes, block, 0, kShortBytes);

  AlignedBuffer payload(24);
  for (uint8_t i = 0; i < 24; ++i) payload.data()[i] = i;
  ChunkHeader chunk;
  chunk.take = 9;
  chunk.set = 3;
  chunk.width_px = 6;
  chunk.height_px = 4;
  chunk.format = RawFormat::kBayerRg8;
  chunk.frame_bytes = chunk.payload_bytes = 24;
  chunk.checksum = Checksum(payload.data(), 24);
  WriteBlock(chunk, at);
  blocks.replace(kShortBytes, kShortBytes, block, 0, kShortBytes);
  blocks.replace(2 * kShortBytes, 24, reinterpret_cast<const char*>(payload.data()), 24);
  AppendTo(index, RecordOf(chunk, kBlockBytes));

  RawFrame frame;
  frame.width_px = 6;
  frame.height_px = 4;
  frame.format = RawFormat::kBayerRg8;
  frame.bytes = std::shared_ptr<const AlignedBuffer>(&payload, [](const AlignedBuffer*) {});
  const auto packed = EncodeFrame(frame, 1);
  FuzzRequire(packed.ok());
  chunk.codec = PayloadCodec::kPlanesZstd;
  chunk.sequence = 1;
  chunk.set = 4;
  chunk.payload_bytes = (*packed)->size();
  chunk.checksum = Checksum((*packed)->data(), (*packed)->size());
  WriteBlock(chunk, at);
  blocks.replace(3 * kShortBytes, kShortBytes, block, 0, kShortBytes);
  blocks.replace(4 * kShortBytes, (*packed)->size(), reinterpret_cast<const char*>((*packed)->data()),
                 (*packed)->size());
  AppendTo(index, RecordOf(chunk, 3 * kBlockBytes));

  ChunkHeader missing;
  missing.take = 9;
  missing.sequence = 2;
  missing.set = 5;
  missing.codec = PayloadCodec::kMissing;
  missing.reason = "lost";
  missing.checksum = Checksum(nullptr, 0);
  WriteBlock(missing, at);
  blocks.replace(5 * kShortBytes, kShortBytes, block, 0, kShortBytes);
  AppendTo(index, RecordOf(missing, 5 * kBlockBytes));

  StreamEnd end;
  end.take = 9;
  end.chunks = 3;
  end.last_set = 5;
  WriteBlock(end, at);
  blocks.replace(6 * kShortBytes, kShortBytes, block, 0, kShortBytes);

  const std::string prefix = {1, static_cast<char>(blocks.size() & 0xff),
                              static_cast<char>(blocks.size() >> 8)};
  return {prefix + blocks + index};
}
