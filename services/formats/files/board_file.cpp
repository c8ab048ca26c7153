#include "services/formats/files/board_file.h"

#include <filesystem>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "capture/image/image_file.h"
#include "pattern/board/joint_board.h"
#include "pattern/board/panel_mask.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "weft/v1/board.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr uintmax_t kMostImageBytes = uintmax_t{256} << 20;  // a pixel is a cell

absl::StatusOr<Board> ReadBoardImage(const std::string& path) {
  std::error_code error;
  if (const uintmax_t bytes = fs::file_size(path, error); !error && bytes > kMostImageBytes) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": has ", bytes, " bytes, more than the ",
                                                   kMostImageBytes, " that the image of a board may have"));
  }
  const absl::StatusOr<Frame> image = ReadImageFile(path);
  if (!image.ok()) return image.status();
  absl::StatusOr<Board> board = BoardFromImage(*image);
  if (!board.ok()) {
    const std::string why(board.status().message());
    const bool named = why.find(path) != std::string::npos;
    return absl::InvalidArgumentError(named ? why : absl::StrCat(path, ": ", why));
  }
  return board;
}

absl::Status Mismatch(const std::string& path, const char* field, const std::string& says,
                      const std::string& image, const std::string& has) {
  return absl::InvalidArgumentError(absl::StrCat(path, ": the field ", field, " says ", says,
                                                 ", but the image ", image, " has ", has,
                                                 "; the two files do not belong together"));
}

// The file beside a board.json that a field names.
absl::StatusOr<std::string> FileBeside(const std::string& path, const char* field, const fs::path& name) {
  if (name.has_parent_path()) {
    return absl::InvalidArgumentError(absl::StrCat(
        path, ": the field ", field, " must name a file in the same folder, not ", name.string()));
  }
  return (fs::path(path).parent_path() / name).string();
}

absl::Status ReadPanels(const std::string& path, const std::string& name, Board* board) {
  const absl::StatusOr<std::string> file = FileBeside(path, "panels", name);
  if (!file.ok()) return file.status();
  const absl::StatusOr<std::vector<uint8_t>> panels = ReadPanelMask(*file, board->rows, board->cols);
  if (!panels.ok()) return panels.status();
  board->panels = *panels;
  return absl::OkStatus();
}

absl::Status CheckPartHashes(const std::string& path, const v1::Board& proto, const Board& board) {
  for (int i = 0; i < proto.parts_size(); ++i) {
    const std::string& says = proto.parts(i).hash();
    const std::string has = PartOfBoard(board, i).ContentHash();
    if (!says.empty() && says != has)
      return absl::InvalidArgumentError(absl::StrCat(path, ": the field parts[", i, "].hash says ", says,
                                                     ", but the image has ", has,
                                                     " in its rows; join the boards again"));
  }
  return absl::OkStatus();
}

absl::StatusOr<Board> ReadBoardJson(const std::string& path) {
  v1::Board proto;
  if (absl::Status status = ReadJsonFile(path, proto, kInputJson); !status.ok()) return status;
  const fs::path image_name = proto.image().empty() ? "board.png" : proto.image();
  const absl::StatusOr<std::string> image_file = FileBeside(path, "image", image_name);
  if (!image_file.ok()) return image_file.status();
  const std::string& image = *image_file;
  absl::StatusOr<Board> board = ReadBoardImage(image);
  if (!board.ok()) return board.status();
  if (proto.rows() != board->rows)
    return Mismatch(path, "rows", absl::StrCat(proto.rows()), image, absl::StrCat(board->rows));
  if (proto.cols() != board->cols)
    return Mismatch(path, "cols", absl::StrCat(proto.cols()), image, absl::StrCat(board->cols));
  if (proto.has_hash() && proto.hash() != board->ContentHash())
    return Mismatch(path, "hash", proto.hash(), image, board->ContentHash());
  if (proto.has_id()) board->id = proto.id();
  board->cell_mm = proto.cell_mm();
  if (proto.has_square_fraction()) board->square_fraction = proto.square_fraction();
  if (!proto.panels().empty()) {
    if (absl::Status status = ReadPanels(path, proto.panels(), &*board); !status.ok()) return status;
  }
  for (const v1::BoardPart& part : proto.parts())
    board->parts.push_back(
        {part.id(), part.first_row(), part.rows(), part.cols(), part.cell_mm(), part.has_panels()});
  if (absl::Status status = board->Validate(); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", status.message()));
  }
  if (absl::Status status = CheckPartHashes(path, proto, *board); !status.ok()) return status;
  return board;
}

}  // namespace

absl::StatusOr<std::vector<uint8_t>> ReadPanelMask(const std::string& path, int rows, int cols) {
  const absl::StatusOr<Frame> mask = ReadImageFile(path);
  if (!mask.ok()) return mask.status();
  if (mask->height_px != rows || mask->width_px != cols) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", mask->height_px, " rows and ", mask->width_px,
                                                   " columns of pixels, the board has ", rows, "x", cols,
                                                   " cells; a panel mask has one pixel per cell"));
  }
  return PanelsFromMask(*mask);
}

absl::StatusOr<Board> ReadBoard(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return ReadBoardJson((fs::path(path) / "board.json").string());
  if (!fs::exists(path, error)) return absl::NotFoundError(absl::StrCat(path, ": no such file"));
  const std::string ending = absl::AsciiStrToLower(fs::path(path).extension().string());
  return ending == ".json" ? ReadBoardJson(path) : ReadBoardImage(path);
}

absl::Status WriteBoard(const std::string& folder, const Board& board, const std::string& provenance) {
  if (absl::Status status = board.Validate(); !status.ok()) return status;
  if (absl::Status status = CreateFolders(folder); !status.ok()) return status;
  const fs::path base(folder);
  if (absl::Status status = WriteImageFile((base / "board.png").string(), BoardToImage(board)); !status.ok())
    return status;
  v1::Board proto;
  if (!board.id.empty()) proto.set_id(board.id);
  proto.set_hash(board.ContentHash());
  if (!provenance.empty()) proto.set_provenance(provenance);
  proto.set_rows(board.rows);
  proto.set_cols(board.cols);
  proto.set_cell_mm(board.cell_mm);
  proto.set_square_fraction(board.square_fraction);
  proto.set_image("board.png");
  if (!board.panels.empty()) {
    const Frame mask = PanelsToMask(board.panels, board.rows, board.cols);
    if (absl::Status status = WriteImageFile((base / "panels.png").string(), mask); !status.ok())
      return status;
    proto.set_panels("panels.png");
  }
  for (size_t i = 0; i < board.parts.size(); ++i) {
    const BoardPart& part = board.parts[i];
    v1::BoardPart& out = *proto.add_parts();
    out.set_id(part.id);
    out.set_hash(PartOfBoard(board, static_cast<int>(i)).ContentHash());
    out.set_first_row(part.first_row);
    out.set_rows(part.rows);
    out.set_cols(part.cols);
    out.set_cell_mm(part.cell_mm);
    out.set_has_panels(part.has_panels);
  }
  return WriteJsonFile((base / "board.json").string(), proto, JsonZeros::kOmitted);
}

}  // namespace weft
