#include "pattern/surface/isolated_components.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "pattern/seeds/patch_decoder.h"

namespace weft {
namespace {

// A cell beyond a fold has no neighbours to speak for it.
constexpr FitLimits kLimits{.iterations = 6,
                            .min_explained = 0.6f,
                            .min_ink_lead = 0.3f,
                            .max_move_cells = 0.5f,
                            .min_edge_px = 0,
                            .min_area_px = 0};

constexpr int kBucketPx = 16, kFarthestBuckets = 3;
constexpr float kFarthestCells = 10;
// Known cells from which the print may go on to a blob, and readings of it that are fitted. From 5 anchors to
// 2, recall changes by at most 0.03 points; with 1, tube loses 0.1. accuracy_decode on takes of `weft
// simulate` (quickstart with seed 11; pleats and curls with seed 1), November 2026.
constexpr size_t kMostAnchors = 2, kMostReadings = 2;
// Rows or columns of the board between them.
constexpr int kBetweenAnchors = 3;
// Pitches that a blob may belong to, in px of the image where it was found.
constexpr float kLeastPitchPx = 2, kLargestPitchPx = 9;

// Evidence of each ink at the nine places of a window; the last is for places off the board.
constexpr int kLabels = kCellColors + 1, kRowCodes = kLabels * kLabels * kLabels;
using WindowEvidence = std::array<std::array<float, kLabels>, 9>;
// The same for three cells of a row together.
using RowCodeEvidence = std::array<std::array<float, kRowCodes>, 3>;

struct Reading {
  float evidence;
  int row, col;
};

// A known cell near a blob; the nearest are the least.
struct Near {
  float squared;  // distance
  int cell;
  bool operator<(const Near& other) const {
    return squared != other.squared ? squared < other.squared : cell < other.cell;
  }
};

// Where the image shows nothing but the inside of known cells.
class CoveredPixels {
 public:
  CoveredPixels(const PixelVector<ViewCell>& known, int width_px, int height_px)
      : columns_(width_px / kTilePx + 1),
        rows_(height_px / kTilePx + 1),
        covered_(static_cast<size_t>(columns_) * rows_, 0) {
    for (const ViewCell& cell : known) Cover(cell.fit.pose);
  }
  bool Contains(float x, float y) const {
    return covered_[static_cast<size_t>(Tile(y, rows_)) * columns_ + Tile(x, columns_)] != 0;
  }

 private:
  static constexpr int kTilePx = 2;

  int Tile(float v, int count) const { return std::clamp(static_cast<int>(v) / kTilePx, 0, count - 1); }

  // A tile is in the cell where its middle is in the cell less the reach of a tile.
  void Cover(const CellPose& f) {
    const float half = 0.5f * kTilePx, area = f.Area();
    const float most_u = 0.5f * area - half * (std::abs(f.by) + std::abs(f.bx)),
                most_v = 0.5f * area - half * (std::abs(f.ax) + std::abs(f.ay));
    if (most_u <= 0 || most_v <= 0) return;
    const float reach_x = 0.5f * (std::abs(f.ax) + std::abs(f.bx)),
                reach_y = 0.5f * (std::abs(f.ay) + std::abs(f.by));
    const int last_x = Tile(f.x + reach_x, columns_), last_y = Tile(f.y + reach_y, rows_);
    for (int y = Tile(f.y - reach_y, rows_); y <= last_y; ++y) {
      for (int x = Tile(f.x - reach_x, columns_); x <= last_x; ++x) {
        const float dx = static_cast<float>(kTilePx * x) + half - f.x,
                    dy = static_cast<float>(kTilePx * y) + half - f.y;
        if (std::abs(f.by * dx - f.bx * dy) < most_u && std::abs(f.ax * dy - f.ay * dx) < most_v)
          covered_[static_cast<size_t>(y) * columns_ + x] = 1;
      }
    }
  }

  int columns_, rows_;
  PixelVector<uint8_t> covered_;  // [rows][columns]
};

class ComponentSearch {
 public:
  ComponentSearch(const CellFitter& fitter, const InkModel& inks, const BoardState& state,
                  const IsolatedOptions& options)
      : fitter_(fitter),
        pyramid_(fitter.pyramid()),
        board_(state.board()),
        inks_(inks),
        state_(state),
        known_(state.cells()),
        options_(options),
        centers_(Centers(known_), state.width_px(), state.height_px()),
        covered_(known_, state.width_px(), state.height_px()),
        bucket_columns_(state.width_px() / kBucketPx + 1),
        bucket_rows_(state.height_px() / kBucketPx + 1),
        buckets_(static_cast<size_t>(bucket_columns_) * bucket_rows_),
        row_codes_(static_cast<size_t>(board_.rows + 2) * board_.cols, kRowCodes - 1) {
    for (int row = 0; row < board_.rows; ++row) {
      for (int col = 0; col < board_.cols; ++col) {
        int code = 0;
        for (int c = col - 1; c <= col + 1; ++c)
          code =
              kLabels * code + (board_.Contains(row, c) ? static_cast<int>(board_.at(row, c)) : kCellColors);
        *RowCodeAt(row, col) = static_cast<uint16_t>(code);
      }
    }
    for (size_t k = 0; k < known_.size(); ++k) {
      const CellPose& f = known_[k].fit.pose;
      Best& best = buckets_[static_cast<size_t>(Bucket(f.y, bucket_rows_)) * bucket_columns_ +
                            Bucket(f.x, bucket_columns_)];
      if (best.cell < 0 || known_[k].fit.explained > known_[best.cell].fit.explained)
        best = {f.x, f.y, f.Area(), static_cast<int>(k)};
      last_group_ = std::max(last_group_, known_[k].group);
    }
    MarkNearKnown();
    seen_.resize(buckets_.size());
  }

  std::vector<PlacedCell> Run(const std::vector<LooseBlob>& blobs) {
    for (const LooseBlob& blob : blobs) {
      if (covered_.Contains(blob.x_px, blob.y_px)) continue;  // most are
      FindAnchors(blob);
      if (anchors_.empty() || !FirstTime(blob)) continue;
      read_at_ = {};
      for (const int anchor : anchors_) ReadFrom(known_[anchor], blob);
    }
    return std::move(seeds_);
  }

 private:
  // The best explained known cell of a bucket; with what most blobs ask it for.
  struct Best {
    float x = 0, y = 0, area_px2 = 0;
    int cell = -1;  // -1 where there is none
  };

  int Bucket(float v, int count) const { return std::clamp(static_cast<int>(v) / kBucketPx, 0, count - 1); }

  void MarkNearKnown() {
    near_known_.assign(buckets_.size(), 0);
    for (int row = 0; row < bucket_rows_; ++row) {
      for (int column = 0; column < bucket_columns_; ++column) {
        if (buckets_[static_cast<size_t>(row) * bucket_columns_ + column].cell < 0) continue;
        const int first = std::max(column - kFarthestBuckets, 0),
                  last = std::min(column + kFarthestBuckets, bucket_columns_ - 1);
        for (int y = std::max(row - kFarthestBuckets, 0);
             y <= std::min(row + kFarthestBuckets, bucket_rows_ - 1); ++y)
          std::fill_n(&near_known_[static_cast<size_t>(y) * bucket_columns_ + first], last - first + 1, 1);
      }
    }
  }

  // Of rows -1 to rows.
  uint16_t* RowCodeAt(int row, int col) {
    return &row_codes_[static_cast<size_t>(row + 1) * board_.cols + col];
  }

  static std::vector<Keypoint> Centers(const PixelVector<ViewCell>& cells) {
    std::vector<Keypoint> centers;
    for (const ViewCell& cell : cells) centers.push_back({cell.fit.pose.x, cell.fit.pose.y, 0});
    return centers;
  }

  // Whether a blob lies in a known cell, as large as `alike` or smaller.
  bool Known(const LooseBlob& blob, const CellPose& alike) const {
    const float radius = std::max(std::hypot(alike.ax + alike.bx, alike.ay + alike.by),
                                  std::hypot(alike.ax - alike.bx, alike.ay - alike.by)) /
                         2;
    bool known = false;
    centers_.Around(blob.x_px, blob.y_px, radius, [&](const auto& places) {
      known = std::any_of(places.begin(), places.end(), [&](const KeypointGrid::Place& place) {
        return known_[place.index].fit.pose.Contains(blob.x_px - place.x, blob.y_px - place.y);
      });
      return known;
    });
    return known;
  }

  // Adds the best explained known cells that are up to `reach` buckets from a blob and may have its size.
  void FindNear(const LooseBlob& blob, int reach) {
    near_.clear();
    const int column = Bucket(blob.x_px, bucket_columns_), row = Bucket(blob.y_px, bucket_rows_);
    const int first = std::max(column - reach, 0), last = std::min(column + reach, bucket_columns_ - 1);
    const float scale2 = static_cast<float>(1 << 2 * blob.level);
    const float least_px2 = scale2 * kLeastPitchPx * kLeastPitchPx,
                largest_px2 = scale2 * kLargestPitchPx * kLargestPitchPx;
    for (int y = std::max(row - reach, 0); y <= std::min(row + reach, bucket_rows_ - 1); ++y) {
      const Best* buckets = &buckets_[static_cast<size_t>(y) * bucket_columns_];
      for (int x = first; x <= last; ++x) {
        const Best& best = buckets[x];
        if (best.cell < 0 || best.area_px2 < least_px2 || best.area_px2 > largest_px2) continue;
        const float dx = blob.x_px - best.x, dy = blob.y_px - best.y, squared = dx * dx + dy * dy;
        if (squared <= kFarthestCells * kFarthestCells * best.area_px2) near_.push_back({squared, best.cell});
      }
    }
  }

  bool IsInNearest(const LooseBlob& blob) const {
    return !near_.empty() && Known(blob, known_[std::min_element(near_.begin(), near_.end())->cell].fit.pose);
  }

  // The best explained known cells near a blob that is in none of them: the nearest one, and further ones
  // that are elsewhere on the board.
  void FindAnchors(const LooseBlob& blob) {
    anchors_.clear();
    const int column = Bucket(blob.x_px, bucket_columns_), row = Bucket(blob.y_px, bucket_rows_);
    if (!near_known_[static_cast<size_t>(row) * bucket_columns_ + column]) return;
    for (const int reach : {0, 1, kFarthestBuckets}) {
      FindNear(blob, reach);
      if (IsInNearest(blob)) return;
    }
    while (anchors_.size() < kMostAnchors && !near_.empty()) {
      const int nearest = std::min_element(near_.begin(), near_.end())->cell;
      anchors_.push_back(nearest);
      std::erase_if(near_, [&](const Near& other) {
        const ViewCell &s = known_[nearest], &t = known_[other.cell];
        return std::max(std::abs(s.row - t.row), std::abs(s.col - t.col)) <= kBetweenAnchors;
      });
    }
  }

  // Whether no blob has been looked at that is nearly the same place; then notes this one. Most blobs are in
  // several images of the pyramid.
  bool FirstTime(const LooseBlob& blob) {
    constexpr float kSame = 0.2f;  // of a cell
    const float reach2 = kSame * kSame * known_[anchors_.front()].fit.pose.Area();
    const int column = Bucket(blob.x_px, bucket_columns_), row = Bucket(blob.y_px, bucket_rows_);
    for (int y = std::max(row - 1, 0); y <= std::min(row + 1, bucket_rows_ - 1); ++y) {
      for (int x = std::max(column - 1, 0); x <= std::min(column + 1, bucket_columns_ - 1); ++x) {
        for (const LooseBlob* other : seen_[static_cast<size_t>(y) * bucket_columns_ + x]) {
          const float dx = blob.x_px - other->x_px, dy = blob.y_px - other->y_px;
          if (dx * dx + dy * dy < reach2) return false;
        }
      }
    }
    seen_[static_cast<size_t>(row) * bucket_columns_ + column].push_back(&blob);
    return true;
  }

  // Whether cells are so alike that the same colours are around them.
  static bool SameShape(const CellPose& f, const CellPose& g) {
    constexpr float kAlike = 0.15f;
    const float limit = kAlike * kAlike * std::max(f.ax * f.ax + f.ay * f.ay, f.bx * f.bx + f.by * f.by);
    const auto squared = [](float x, float y) { return x * x + y * y; };
    return squared(f.ax - g.ax, f.ay - g.ay) < limit && squared(f.bx - g.bx, f.by - g.by) < limit;
  }

  // Colours at a cell and around it, as evidence of inks.
  WindowEvidence ReadWindow(const CellPose& pose) const {
    const int level = PyramidLevelFor(pose.ShorterEdge(), pyramid_.size());
    const CellPose f = pose.InHalvings(static_cast<float>(1 << level));
    std::array<Rgb, 9> colors;
    float light = 0;
    for (int k = 0; k < 9; ++k) {
      const float u = static_cast<float>(k % 3 - 1), v = static_cast<float>(k / 3 - 1);
      colors[k] = SampleColor(pyramid_[level], f.x + u * f.ax + v * f.bx, f.y + u * f.ay + v * f.by);
      light += colors[k][0] + colors[k][1] + colors[k][2];
    }
    light = std::max(light / 27, 1.0f);
    WindowEvidence window;
    for (int k = 0; k < 9; ++k) {
      // Neighbours may be hidden, and are not quite where the frame puts them.
      const float weight = k == 4 ? 1.0f : (k % 2 == 1 ? 0.8f : 0.6f);
      for (float& channel : colors[k]) channel /= light;
      const CellReading reading = ReadCell(inks_, colors[k]);
      for (int ink = 0; ink < kCellColors; ++ink) window[k][ink] = weight * reading.evidence[ink];
      window[k][kCellColors] = -weight;
    }
    return window;
  }

  void ReadRowCodes(const CellPose& pose) {
    read_at_ = pose;
    const WindowEvidence window = ReadWindow(pose);
    most_of_codes_ = {};
    for (int k = 0; k < 9; ++k)
      most_of_codes_[k / 3] += *std::max_element(window[k].begin(), window[k].end());
    most_evidence_ = most_of_codes_[0] + most_of_codes_[1] + most_of_codes_[2];
    if (most_evidence_ <= options_.min_evidence) return;
    for (int i = 0; i < 3; ++i) {
      float* next = of_codes_[i].data();
      for (const float left : window[3 * i]) {
        for (const float middle : window[3 * i + 1]) {
          for (const float right : window[3 * i + 2]) *next++ = left + middle + right;
        }
      }
    }
  }

  // The missing cells around the anchor that the image looks like most, best first.
  void FindReadings(const ViewCell& anchor) {
    readings_.clear();
    if (most_evidence_ <= options_.min_evidence) return;
    const int reach = options_.reach_cells;
    const int first_row = std::max(anchor.row - reach, 0), first_col = std::max(anchor.col - reach, 0);
    const int last_row = std::min(anchor.row + reach, board_.rows - 1),
              last_col = std::min(anchor.col + reach, board_.cols - 1);
    const float *above = of_codes_[0].data(), *here = of_codes_[1].data(), *below = of_codes_[2].data();
    // Most cells fall short whatever is above and below them.
    constexpr float kRounding = 1e-3f;
    const float others = most_of_codes_[0] + most_of_codes_[2] + kRounding;
    // What a further reading has to exceed.
    float bar = std::nextafter(options_.min_evidence, 0.0f);
    for (int row = first_row; row <= last_row; ++row) {
      const uint16_t *up = RowCodeAt(row - 1, 0), *at = RowCodeAt(row, 0), *down = RowCodeAt(row + 1, 0);
      for (int col = first_col; col <= last_col; ++col) {
        const float middle = here[at[col]];
        if (middle + others <= bar) continue;
        const float evidence = above[up[col]] + middle + below[down[col]];
        if (evidence <= bar || state_.At(row, col) >= 0) continue;
        if (readings_.size() == kMostReadings) readings_.pop_back();
        const auto place = std::find_if(readings_.begin(), readings_.end(),
                                        [evidence](const Reading& r) { return r.evidence < evidence; });
        readings_.insert(place, {evidence, row, col});
        if (readings_.size() == kMostReadings) bar = readings_.back().evidence;
      }
    }
  }

  void ReadFrom(const ViewCell& anchor, const LooseBlob& blob) {
    static constexpr NeighborWeights kWeights = {0.6f, 0.6f, 0.6f, 0.6f, 1, 0.6f, 0.6f, 0.6f, 0.6f};
    CellPose pose = anchor.fit.pose;
    pose.x = blob.x_px;
    pose.y = blob.y_px;
    if (!SameShape(pose, read_at_)) ReadRowCodes(pose);
    FindReadings(anchor);
    for (const Reading& reading : readings_) {
      const CellFit fit = fitter_.Fit({reading.row, reading.col, pose, kWeights}, kLimits);
      if (!Reject(fit, kLimits)) seeds_.push_back({reading.row, reading.col, fit.pose, ++last_group_});
    }
  }

  const CellFitter& fitter_;
  const std::vector<ColorImage>& pyramid_;
  const Board& board_;
  const InkModel& inks_;
  const BoardState& state_;
  const PixelVector<ViewCell>& known_;
  const IsolatedOptions& options_;
  KeypointGrid centers_;  // of known cells
  CoveredPixels covered_;
  int bucket_columns_, bucket_rows_;
  std::vector<Best> buckets_;
  std::vector<uint8_t> near_known_;  // whether one of the buckets around has a known cell
  // [rows + 2][cols], a cell and those left and right of it as a number; a row off the board above and below.
  std::vector<uint16_t> row_codes_;
  CellPose read_at_;  // where of_codes_ is from
  RowCodeEvidence of_codes_;
  std::array<float, 3> most_of_codes_ = {};
  float most_evidence_ = 0;  // that any window may have there
  int last_group_ = 0;
  std::vector<std::vector<const LooseBlob*>> seen_;  // by bucket
  std::vector<Near> near_;
  std::vector<int> anchors_;
  std::vector<Reading> readings_;
  std::vector<PlacedCell> seeds_;
};

}  // namespace

absl::Status IsolatedOptions::Validate() const {
  if (reach_cells < 1 || reach_cells > 100)
    return absl::InvalidArgumentError("isolated.reach_cells must lie in 1 to 100");
  if (!(min_evidence > 0)) return absl::InvalidArgumentError("isolated.min_evidence must be above 0");
  return absl::OkStatus();
}

std::vector<PlacedCell> FindIsolatedSeeds(const CellFitter& fitter, const InkModel& inks,
                                          const BoardState& state, const std::vector<LooseBlob>& blobs,
                                          const IsolatedOptions& options) {
  return ComponentSearch(fitter, inks, state, options).Run(blobs);
}

}  // namespace weft
