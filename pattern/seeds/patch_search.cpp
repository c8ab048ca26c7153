#include "pattern/seeds/patch_search.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "pattern/seeds/strip_decoder.h"

namespace weft {
namespace {

constexpr float kFades[] = {0.0f, 0.25f, 0.45f, 0.6f, 0.75f};

// What a piece needs to stand by itself, in nats.
float LeastEvidence(const LevelPatch& patch, const PatchDecodeOptions& options) {
  return patch.is_strip ? options.min_evidence_contradicted : options.min_evidence;
}

// Good enough to learn inks from, whatever the patch around it says.
bool Readable(const LevelPatch& patch, const DecodedPiece& piece, const PatchDecodeOptions& options) {
  return (piece.centers.size() >= 2 || piece.contradicted == 0) &&
         piece.evidence >= LeastEvidence(patch, options) && piece.margin >= options.min_margin;
}

void Read(const InkModel& inks, const BoardIndex& board, LevelPatch* patch) {
  ClassifyPatch(inks, &patch->measured);
  patch->pieces = patch->is_strip ? DecodeStrip(patch->measured, board) : DecodePatch(patch->measured, board);
}

// Cells in readable pieces, after reading the patches.
size_t CountReadable(const InkModel& inks, const BoardIndex& board, const PatchDecodeOptions& options,
                     std::span<LevelPatch> patches) {
  size_t readable = 0;
  for (LevelPatch& patch : patches) {
    Read(inks, board, &patch);
    for (const DecodedPiece& piece : patch.pieces) {
      if (Readable(patch, piece, options)) readable += piece.cells.size();
    }
  }
  return readable;
}

std::vector<InkSample> Samples(const Board& board, const PatchDecodeOptions& options,
                               std::span<const LevelPatch> patches) {
  std::vector<InkSample> samples;
  for (const LevelPatch& patch : patches) {
    for (const DecodedPiece& piece : patch.pieces) {
      if (!Readable(patch, piece, options)) continue;
      for (const int k : piece.cells) {
        const PatchCell& c = patch.measured.lattice.cells[k];
        const BoardCell at = piece.pose.ToBoard(c.i, c.j);
        if (board.Contains(at.row, at.col))
          samples.push_back({patch.measured.colors[k], board.at(at.row, at.col)});
      }
    }
  }
  return samples;
}

Rgb MeanColor(std::span<const LevelPatch> patches) {
  Rgb mean = {};
  size_t n = 0;
  for (const LevelPatch& patch : patches) {
    for (const Rgb& color : patch.measured.colors) {
      for (int c = 0; c < 3; ++c) mean[c] += color[c];
      ++n;
    }
  }
  for (float& m : mean) m /= static_cast<float>(std::max<size_t>(n, 1));
  return mean;
}

// A few thousand cells are enough to learn from: the largest patches, or the first cells of them, which are
// near each other.
std::vector<LevelPatch> LearningPart(const std::vector<LevelPatch>& patches) {
  constexpr size_t kCells = 4000, kCellsOfOne = 1000;
  std::vector<LevelPatch> some;
  size_t cells = 0;
  for (const LevelPatch& patch : patches) {
    if (cells >= kCells) break;
    LevelPatch part;
    part.is_strip = patch.is_strip;
    part.measured = patch.measured;
    const size_t kept = std::min(kCellsOfOne, part.measured.colors.size());
    part.measured.lattice.cells.resize(kept);
    part.measured.colors.resize(kept);
    for (int& cell : part.measured.grid) cell = cell < static_cast<int>(kept) ? cell : -1;
    cells += kept;
    some.push_back(std::move(part));
  }
  return some;
}

// The pose of a patch's cell in the directions of the board, in pixels of the full image.
CellPose PoseOnBoard(const LevelPatch& patch, int cell, const BoardPose& pose) {
  const PatchCell& c = patch.measured.lattice.cells[cell];
  const Keypoint& p = patch.points[cell];
  const float s = patch.scale;
  switch (pose.quarter_turns & 3) {
    case 0:
      return {p.x_px, p.y_px, s * c.ax, s * c.ay, s * c.bx, s * c.by};
    case 1:
      return {p.x_px, p.y_px, -s * c.bx, -s * c.by, s * c.ax, s * c.ay};
    case 2:
      return {p.x_px, p.y_px, -s * c.ax, -s * c.ay, -s * c.bx, -s * c.by};
    default:
      return {p.x_px, p.y_px, s * c.bx, s * c.by, -s * c.ax, -s * c.ay};
  }
}

// A keypoint of an image `scale` times smaller; pixel x of it is at (x + 0.5) scale - 0.5 of the full image.
Keypoint InFullImage(const Keypoint& p, float scale) {
  return {(p.x_px + 0.5f) * scale - 0.5f, (p.y_px + 0.5f) * scale - 0.5f, p.contrast};
}

// Whether a lattice is finer than the cells: in very sharp pictures the corners of a printed square are
// spots, too. On a board cells next to each other never have the same colour, while some two steps apart do;
// along an axis that splits cells every second part has its neighbour's.
bool SplitsCells(const MeasuredPatch& patch) {
  constexpr size_t kCells = 1000;
  constexpr float kAlike = 0.75f;
  const auto squared_difference = [](const Rgb& s, const Rgb& t) {
    float sum = 0;
    for (int c = 0; c < 3; ++c) sum += (s[c] - t[c]) * (s[c] - t[c]);
    return sum;
  };
  const auto splits_along = [&](int di, int dj) {
    float one_step = 0, two_steps = 0;
    for (size_t k = 0; k < std::min(kCells, patch.colors.size()); ++k) {
      const PatchCell& c = patch.lattice.cells[k];
      const int next = patch.CellAt(c.i + di, c.j + dj), after = patch.CellAt(c.i + 2 * di, c.j + 2 * dj);
      if (next < 0 || after < 0) continue;
      one_step += squared_difference(patch.colors[k], patch.colors[next]);
      two_steps += squared_difference(patch.colors[k], patch.colors[after]);
    }
    return one_step < kAlike * two_steps;
  };
  return splits_along(0, 1) || splits_along(1, 0);
}

// Where the full image shows the inside of large patches.
class FoundPlaces {
 public:
  FoundPlaces(int width_px, int height_px)
      : columns_(width_px / kBucketPx + 1), rows_(height_px / kBucketPx + 1) {
    found_.assign(static_cast<size_t>(columns_) * rows_, false);
  }

  void Add(const LevelPatch& patch) {
    if (patch.points.size() < kLeastCells || SplitsCells(patch.measured)) return;
    for (size_t k = 0; k < patch.points.size(); ++k) {
      const PatchCell& c = patch.measured.lattice.cells[k];
      if (!Inside(patch.measured, c)) continue;
      const Keypoint& p = patch.points[k];
      const float half_x = 0.5f * patch.scale * (std::abs(c.ax) + std::abs(c.bx)),
                  half_y = 0.5f * patch.scale * (std::abs(c.ay) + std::abs(c.by));
      const int last = Bucket(p.x_px + half_x, columns_);
      for (int y = Bucket(p.y_px - half_y, rows_); y <= Bucket(p.y_px + half_y, rows_); ++y) {
        for (int x = Bucket(p.x_px - half_x, columns_); x <= last; ++x) found_[At(x, y)] = true;
      }
    }
  }
  bool Contains(const Keypoint& p) const {
    return found_[At(Bucket(p.x_px, columns_), Bucket(p.y_px, rows_))];
  }

 private:
  static constexpr int kBucketPx = 4;
  static constexpr size_t kLeastCells = 30;

  // Whether the cell has a frame, and the patch goes on to all sides; single cells may be missing.
  static bool Inside(const MeasuredPatch& patch, const PatchCell& cell) {
    constexpr int kLeastAround = 21;  // of 5x5; one next to a straight border has 20
    if (!cell.has_frame()) return false;
    int around = 0;
    for (int k = 0; k < 25; ++k) around += patch.CellAt(cell.i + k / 5 - 2, cell.j + k % 5 - 2) >= 0;
    return around >= kLeastAround;
  }
  static int Bucket(float v, int count) { return std::clamp(static_cast<int>(v) / kBucketPx, 0, count - 1); }
  size_t At(int x, int y) const { return static_cast<size_t>(y) * columns_ + x; }

  int columns_, rows_;
  std::vector<bool> found_;  // [rows][columns]
};

// The centers of all pieces of a strip that stand: they show each other's edges.
void AddStripSeeds(const LevelPatch& patch, const Board& board, const PatchDecodeOptions& options, int group,
                   std::vector<PlacedCell>* seeds) {
  std::vector<std::pair<BoardCell, Keypoint>> cells;
  for (const DecodedPiece& piece : patch.pieces) {
    if (!WhyRejected(patch, piece, options).empty()) continue;
    for (const int k : piece.centers) {
      const PatchCell& c = patch.measured.lattice.cells[k];
      const BoardCell at = piece.pose.ToBoard(c.i, c.j);
      if (board.Contains(at.row, at.col)) cells.push_back({at, patch.points[k]});
    }
  }
  for (PlacedCell& cell : PlaceCells(cells)) {
    cell.group = group;
    cell.is_read = true;
    seeds->push_back(cell);
  }
}

}  // namespace

std::vector<LevelPatch> FindPatches(const std::vector<ColorImage>& pyramid, const KeypointOptions& keypoints,
                                    const LatticeOptions& lattice, std::vector<LooseBlob>* loose) {
  std::vector<LevelPatch> patches;
  FoundPlaces found(pyramid[0].width_px, pyramid[0].height_px);
  for (size_t level = 0; level < pyramid.size(); ++level) {
    const float scale = static_cast<float>(1 << level);
    const ColorImage& image = pyramid[level];
    const Plane spots = BlobContrast(image, kSurroundPx);
    std::vector<Keypoint> points = DetectKeypoints(spots, keypoints);
    std::erase_if(points, [&](const Keypoint& p) { return found.Contains(InFullImage(p, scale)); });
    const size_t first = patches.size();
    std::vector<bool> joined(points.size(), false);
    for (const LatticePatch& piece : BuildLattice(points, spots, lattice)) {
      if (piece.cells.size() < 9) continue;
      LevelPatch patch;
      patch.measured = MeasurePatch(piece, points, image);
      patch.level = static_cast<int>(level);
      patch.scale = scale;
      patch.points.reserve(piece.cells.size());
      for (const PatchCell& c : piece.cells) {
        patch.points.push_back(InFullImage(points[c.keypoint], scale));
        joined[c.keypoint] = true;
      }
      patches.push_back(std::move(patch));
    }
    for (size_t k = first; k < patches.size(); ++k) found.Add(patches[k]);
    for (size_t k = 0; k < points.size(); ++k) {
      if (joined[k]) continue;
      const Keypoint p = InFullImage(points[k], scale);
      loose->push_back({p.x_px, p.y_px, static_cast<int>(level)});
    }
  }
  return patches;
}

void ReadPatches(const InkModel& inks, const BoardIndex& board, std::vector<LevelPatch>* patches) {
  for (LevelPatch& patch : *patches) Read(inks, board, &patch);
}

InkModel DecodePatches(const BoardIndex& board, const PatchDecodeOptions& options,
                       std::vector<LevelPatch>* patches) {
  std::stable_sort(patches->begin(), patches->end(), [](const LevelPatch& s, const LevelPatch& t) {
    return s.points.size() > t.points.size();
  });
  std::vector<LevelPatch> some = LearningPart(*patches);
  const Rgb mean = MeanColor(some);
  InkModel best = InkModel::Faded(kFades[0], mean);
  size_t most = 0;
  for (const float fade : kFades) {
    const InkModel inks = InkModel::Faded(fade, mean);
    const size_t readable = CountReadable(inks, board, options, some);
    if (readable > most) {
      most = readable;
      best = inks;
    }
  }
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds && most > 0; ++round) {
    CountReadable(best, board, options, some);
    best = InkModel::Fitted(Samples(board.board(), options, some), best);
  }
  ReadPatches(best, board, patches);
  for (LevelPatch& patch : *patches) {
    // What mostly reads as it should is not a mirror's image.
    const bool read = !patch.pieces.empty() && 2 * patch.pieces.front().cells.size() > patch.points.size();
    patch.mirrored = !read && LooksMirrored(patch.measured, board);
  }
  return best;
}

std::string WhyRejected(const LevelPatch& patch, const DecodedPiece& piece,
                        const PatchDecodeOptions& options) {
  if (patch.mirrored) return "mirrored";
  if (piece.evidence < LeastEvidence(patch, options)) return "too little evidence";
  if (piece.margin < options.min_margin) return "no margin over the runner-up";
  const float most_contradicted = options.max_contradicted * static_cast<float>(piece.cells.size());
  const bool contradicted = static_cast<float>(piece.contradicted) > most_contradicted;
  if (contradicted && piece.evidence < options.min_evidence_contradicted)
    return "contradicted by the cells around";
  return "";
}

void AddUnread(const std::vector<LevelPatch>& patches, const PatchDecodeOptions& options,
               std::vector<LooseBlob>* loose) {
  std::vector<bool> read;
  for (const LevelPatch& patch : patches) {
    read.assign(patch.points.size(), false);
    for (const DecodedPiece& piece : patch.pieces) {
      if (!WhyRejected(patch, piece, options).empty()) continue;
      for (const int k : piece.cells) read[k] = true;
    }
    for (size_t k = 0; k < read.size(); ++k) {
      if (!read[k]) loose->push_back({patch.points[k].x_px, patch.points[k].y_px, patch.level});
    }
  }
}

std::vector<PlacedCell> SeedsOf(const std::vector<LevelPatch>& patches, const Board& board,
                                const PatchDecodeOptions& options) {
  std::vector<PlacedCell> seeds;
  int group = 0;
  for (const LevelPatch& patch : patches) {
    if (patch.is_strip) {
      AddStripSeeds(patch, board, options, ++group, &seeds);
      continue;
    }
    for (const DecodedPiece& piece : patch.pieces) {
      ++group;
      if (!WhyRejected(patch, piece, options).empty()) continue;
      for (const int k : piece.centers) {
        const PatchCell& c = patch.measured.lattice.cells[k];
        const BoardCell at = piece.pose.ToBoard(c.i, c.j);
        if (!c.has_frame() || !board.Contains(at.row, at.col)) continue;
        seeds.push_back({at.row, at.col, PoseOnBoard(patch, k, piece.pose), group,
                         piece.evidence >= options.min_evidence_contradicted});
      }
    }
  }
  return seeds;
}

}  // namespace weft
