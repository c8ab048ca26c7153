#include "services/formats/files/board_file.h"

#include <filesystem>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
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
  if (const uint64_t bytes = FileBytes(path); bytes > kMostImageBytes) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": has ", bytes, " bytes, more than the ",
                                                   kMostImageBytes, " that the image of a board may have"));
  }
  WEFT_ASSIGN_OR_RETURN(const Frame image, ReadImageFile(path));
  absl::StatusOr<Board> board = BoardFromImage(image);
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
  WEFT_ASSIGN_OR_RETURN(const std::string file, FileBeside(path, "panels", name));
  WEFT_ASSIGN_OR_RETURN(board->panels, ReadPanelMask(file, board->rows, board->cols));
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
  WEFT_RETURN_IF_ERROR(ReadJsonFile(path, proto, kInputJson));
  const fs::path image_name = proto.image().empty() ? "board.png" : proto.image();
  WEFT_ASSIGN_OR_RETURN(const std::string image_file, FileBeside(path, "image", image_name));
  const std::string& image = image_file;
  WEFT_ASSIGN_OR_RETURN(Board board, ReadBoardImage(image));
  if (proto.rows() != board.rows)
    return Mismatch(path, "rows", absl::StrCat(proto.rows()), image, absl::StrCat(board.rows));
  if (proto.cols() != board.cols)
    return Mismatch(path, "cols", absl::StrCat(proto.cols()), image, absl::StrCat(board.cols));
  if (proto.has_hash() && proto.hash() != board.ContentHash())
    return Mismatch(path, "hash", proto.hash(), image, board.ContentHash());
  if (proto.has_id()) board.id = proto.id();
  board.cell_mm = proto.cell_mm();
  if (proto.has_square_fraction()) board.square_fraction = proto.square_fraction();
  if (!proto.panels().empty()) {
    WEFT_RETURN_IF_ERROR(ReadPanels(path, proto.panels(), &board));
  }
  for (const v1::BoardPart& part : proto.parts())
    board.parts.push_back(
        {part.id(), part.first_row(), part.rows(), part.cols(), part.cell_mm(), part.has_panels()});
  if (absl::Status status = board.Validate(); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", status.message()));
  }
  WEFT_RETURN_IF_ERROR(CheckPartHashes(path, proto, board));
  return board;
}

}  // namespace

absl::StatusOr<std::vector<uint8_t>> ReadPanelMask(const std::string& path, int rows, int cols) {
  WEFT_ASSIGN_OR_RETURN(const Frame mask, ReadImageFile(path));
  if (mask.height_px != rows || mask.width_px != cols) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", mask.height_px, " rows and ", mask.width_px,
                                                   " columns of pixels, the board has ", rows, "x", cols,
                                                   " cells; a panel mask has one pixel per cell"));
  }
  return PanelsFromMask(mask);
}

absl::StatusOr<Board> ReadBoard(const std::string& path) {
  if (IsFolder(path)) return ReadBoardJson((fs::path(path) / "board.json").string());
  if (!PathExists(path)) return absl::NotFoundError(absl::StrCat(path, ": no such file"));
  const std::string ending = absl::AsciiStrToLower(fs::path(path).extension().string());
  return ending == ".json" ? ReadBoardJson(path) : ReadBoardImage(path);
}

absl::Status WriteBoard(const std::string& folder, const Board& board, const std::string& provenance) {
  WEFT_RETURN_IF_ERROR(board.Validate());
  WEFT_RETURN_IF_ERROR(CreateFolders(folder));
  const fs::path base(folder);
  WEFT_RETURN_IF_ERROR(WriteImageFile((base / "board.png").string(), BoardToImage(board)));
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
    WEFT_RETURN_IF_ERROR(WriteImageFile((base / "panels.png").string(), mask));
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
