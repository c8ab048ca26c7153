#include "pattern/decoder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <thread>

#include "tests/pattern/board/test_boards.h"
#include "tests/pattern/rendered_board.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

DecodeResult Decode(const Frame& frame, const BoardIndex& board = TestBoard(),
                    const DecodeOptions& options = {}) {
  const auto result = DecodeView(frame, board, options);
  EXPECT_TRUE(result.ok()) << result.status();
  return result.ok() ? *result : DecodeResult();
}

std::vector<Observation> OfKind(const DecodeResult& result, NodeKind kind) {
  std::vector<Observation> found;
  for (const Observation& o : result.observations) {
    if (o.node.kind == kind) found.push_back(o);
  }
  return found;
}

struct Score {
  int expected = 0;  // printed cells whose surroundings are in the image
  int right = 0;     // within half a pitch
  int wrong = 0;
  double median_px = 0, p95_px = 0;
};

Score Assess(const Photograph& photo, const Board& board, const DecodeResult& result, NodeKind kind) {
  Score score;
  const double shift = kind == NodeKind::kCenter ? 0.5 : 0;
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) {
      if (!Printed(photo, board, row, col)) continue;
      const auto [x, y] = PixelFromBoard(photo, board, col + 0.5, row + 0.5);
      const double margin = photo.pitch_px;
      score.expected +=
          x > margin && y > margin && x < photo.width_px - 1 - margin && y < photo.height_px - 1 - margin;
    }
  }
  std::vector<double> errors;
  for (const Observation& o : OfKind(result, kind)) {
    const auto [x, y] = PixelFromBoard(photo, board, o.node.col + shift, o.node.row + shift);
    const double error = std::hypot(o.x_px - x, o.y_px - y);
    const bool right = error < 0.5 * photo.pitch_px * photo.squeeze;
    (right ? score.right : score.wrong) += 1;
    if (right) errors.push_back(error);
  }
  std::sort(errors.begin(), errors.end());
  if (!errors.empty()) {
    score.median_px = errors[errors.size() / 2];
    score.p95_px = errors[errors.size() * 95 / 100];
  }
  return score;
}

struct DecodeCase {
  const char* name;
  Photograph photo;
};

void PrintTo(const DecodeCase& c, std::ostream* out) { *out << c.name; }

class DecodesPhotographs : public testing::TestWithParam<DecodeCase> {};

TEST_P(DecodesPhotographs, FindsNearlyAllCellsWithSubpixelCenters) {
  const Photograph& photo = GetParam().photo;
  const DecodeResult result = Decode(Render(photo, TestBoard().board()));
  const Score centers = Assess(photo, TestBoard().board(), result, NodeKind::kCenter);
  EXPECT_GE(centers.right, 0.95 * centers.expected);
  EXPECT_EQ(centers.wrong, 0);
  // Large cells are sampled sparsely.
  const double sharp_px = std::max(0.12, 0.01 * photo.pitch_px);
  EXPECT_LT(centers.median_px, sharp_px);
  EXPECT_LT(centers.p95_px, 3 * sharp_px);
  const Score corners = Assess(photo, TestBoard().board(), result, NodeKind::kCorner);
  EXPECT_GE(corners.right, 0.85 * centers.expected);
  EXPECT_EQ(corners.wrong, 0);
  EXPECT_LT(corners.median_px, sharp_px);
}

INSTANTIATE_TEST_SUITE_P(
    Decoder, DecodesPhotographs,
    testing::Values(
        DecodeCase{"Tilted", {}}, DecodeCase{"Upside", {.angle_deg = 185}},
        DecodeCase{"Sideways", {.angle_deg = 93}},
        DecodeCase{"Tiny", {.width_px = 260, .height_px = 240, .pitch_px = 4.2, .blur_px = 0.7, .noise = 2}},
        DecodeCase{"Large", {.width_px = 640, .height_px = 500, .pitch_px = 17, .blur_px = 1.6}},
        DecodeCase{"Foreshortened", {.pitch_px = 7, .squeeze = 0.6}},
        DecodeCase{"Pleated", {.pitch_px = 8, .bend_cells = 0.2, .pleat = 0.55}},
        DecodeCase{"SoftAndFaded", {.pitch_px = 8, .blur_px = 1.7, .noise = 2, .fade = 0.5, .black = 0.25}}),
    [](const auto& test) { return test.param.name; });

TEST(Decoder, DecodesASingleWindow) {
  const Photograph photo{.width_px = 90,
                         .height_px = 80,
                         .pitch_px = 7,
                         .bend_cells = 0.1,
                         .row = 28,
                         .col = 33,
                         .rows = 3,
                         .cols = 3};
  const DecodeResult result = Decode(Render(photo, TestBoard().board()));
  const Score score = Assess(photo, TestBoard().board(), result, NodeKind::kCenter);
  EXPECT_GE(score.right, 5);
  EXPECT_EQ(score.wrong, 0);
}

TEST(Decoder, SigmasAndConfidencesDescribeTheErrors) {
  const Photograph photo{.noise = 8};
  const DecodeResult result = Decode(Render(photo, TestBoard().board()));
  int within_3_sigma = 0, n = 0;
  for (const Observation& o : OfKind(result, NodeKind::kCenter)) {
    const auto [x, y] = PixelFromBoard(photo, TestBoard().board(), o.node.col + 0.5, o.node.row + 0.5);
    within_3_sigma += std::hypot(o.x_px - x, o.y_px - y) < 3 * o.sigma_px;
    ++n;
    EXPECT_GE(o.confidence, DecodeOptions().confidence.min_to_stay);
    EXPECT_LE(o.confidence, 1);
    EXPECT_GT(o.sigma_px, 0);
    EXPECT_LT(o.sigma_px, 0.5 * photo.pitch_px);
  }
  EXPECT_GT(n, 1000);
  EXPECT_GT(within_3_sigma, 0.9 * n);
}

// The photograph with grey cloth over all rows of the board but those before `first_hidden`, and two after
// `first_seen`.
Frame CoverRows(const Photograph& photo, const Board& board, int first_hidden, int first_seen) {
  Frame frame = Render(photo, board);
  auto pixels = std::make_shared<std::vector<uint8_t>>(*frame.pixels);
  for (int y = 0; y < photo.height_px; ++y) {
    for (int x = 0; x < photo.width_px; ++x) {
      const double row = BoardFromPixel(photo, board, x, y).second;
      if (row < first_hidden || (row >= first_seen && row < first_seen + 2)) continue;
      for (int c = 0; c < 3; ++c) (*pixels)[3 * (static_cast<size_t>(y) * photo.width_px + x) + c] = 90;
    }
  }
  frame.pixels = pixels;
  return frame;
}

TEST(Decoder, FindsAStripBeyondACover) {
  // Two rows hold no 3x3 window, so no lattice can be read there but as a strip.
  const Photograph photo{.pitch_px = 7, .bend_cells = 0.1};
  const Board& board = TestBoard().board();
  constexpr int kHidden = 30, kSeen = 33;
  const Frame frame = CoverRows(photo, board, kHidden, kSeen);
  const auto in_strip = [](const DecodeResult& result) {
    return std::ranges::count_if(OfKind(result, NodeKind::kCenter),
                                 [](const Observation& o) { return o.node.row >= kSeen; });
  };
  const DecodeResult result = Decode(frame);
  EXPECT_GE(in_strip(result), 60);
  EXPECT_EQ(Assess(photo, board, result, NodeKind::kCenter).wrong, 0);
  DecodeOptions without;
  without.isolated.min_evidence = 1e9f;
  EXPECT_GE(in_strip(Decode(frame, TestBoard(), without)), 60);
  without.patches.min_evidence_contradicted = 1e9f;  // that of strips
  EXPECT_EQ(in_strip(Decode(frame, TestBoard(), without)), 0);
}

// Cloth whose print begins at column 35 in front of cloth that shows columns up to 30, turned against it; the
// edge between them lies along the front's columns.
class DecodesAFold : public testing::Test {
 protected:
  static constexpr int kShiftPx = 75, kFirst = 35;
  const Board& board_ = TestBoard().board();
  const Photograph front_{.pitch_px = 5, .angle_deg = 20, .bend_cells = 0, .blur_px = 1, .col = kFirst};
  const Photograph back_{
      .width_px = 400 + 2 * 160, .pitch_px = 5, .angle_deg = -8, .bend_cells = 0.3, .blur_px = 1};

  // Distance of a pixel from the edge, beyond it where the back is seen.
  double BeyondEdgePx(double x, double y) const {
    const double u = BoardFromPixel(front_, board_, x, y).first;
    return (kFirst - u) * front_.pitch_px;
  }
  // A pixel of the back in the picture.
  std::pair<double, double> OnBack(int row, int col) const {
    const auto [x, y] = PixelFromBoard(back_, board_, col + 0.5, row + 0.5);
    return {x - kShiftPx, y};
  }

  Frame Film() const {
    Frame frame = Render(front_, board_);
    const Frame back = Render(back_, board_);
    auto pixels = std::make_shared<std::vector<uint8_t>>(*frame.pixels);
    for (int y = 0; y < frame.height_px; ++y) {
      for (int x = 0; x < frame.width_px; ++x) {
        const double share = 0.5 * std::erfc(-BeyondEdgePx(x, y) / (std::sqrt(2.0) * front_.blur_px));
        for (int c = 0; c < 3; ++c) {
          uint8_t& value = (*pixels)[3 * (static_cast<size_t>(y) * frame.width_px + x) + c];
          const uint8_t behind = back.row(y)[3 * (x + kShiftPx) + c];
          value = static_cast<uint8_t>(std::lround(share * behind + (1 - share) * value));
        }
      }
    }
    frame.pixels = pixels;
    return frame;
  }
};

TEST_F(DecodesAFold, FindsCellsAlongTheEdge) {
  const DecodeResult result = Decode(Film());
  std::vector<bool> found(board_.cells.size(), false);
  int wrong = 0;
  for (const Observation& o : OfKind(result, NodeKind::kCenter)) {
    const auto [x, y] = o.node.col >= kFirst
                            ? PixelFromBoard(front_, board_, o.node.col + 0.5, o.node.row + 0.5)
                            : OnBack(o.node.row, o.node.col);
    const bool right = std::hypot(o.x_px - x, o.y_px - y) < 0.5 * front_.pitch_px;
    wrong += !right;
    found[static_cast<size_t>(o.node.row) * board_.cols + o.node.col] = right;
  }
  int seen = 0, missed = 0;
  for (int row = 0; row < board_.rows; ++row) {
    for (int col = 0; col < kFirst; ++col) {
      const auto [x, y] = OnBack(row, col);
      const double beyond = BeyondEdgePx(x, y) / front_.pitch_px;
      if (x < 10 || y < 10 || x > front_.width_px - 10 || y > front_.height_px - 10) continue;
      if (beyond < 0.1 || beyond > 1.1) continue;
      ++seen;
      missed += !found[static_cast<size_t>(row) * board_.cols + col];
    }
  }
  EXPECT_EQ(wrong, 0);
  ASSERT_GT(seen, 60);
  // Growth that takes what is in front for the cells' own surroundings misses 8.
  EXPECT_LE(missed, 5);
}

TEST(Decoder, RejectsAMirroredPrint) {
  EXPECT_THAT(Decode(Render({.mirrored = true}, TestBoard().board())).observations, testing::IsEmpty());
}

TEST(Decoder, RejectsAnotherBoard) {
  const Board other = *GenerateBoard(60, 70, 3.0, 99);
  EXPECT_THAT(Decode(Render({}, other)).observations, testing::IsEmpty());
}

TEST(Decoder, FindsNothingInLargeViewsOfAnotherBoard) {
  // Windows that both boards have give up to a thousand cells, in small components.
  const Board other = *GenerateBoard(150, 200, 3.0, 98);
  const BoardIndex board = *BoardIndex::Build(*GenerateBoard(150, 200, 3.0, 97));
  for (const double pitch_px : {4.0, 5.0}) {
    const Photograph photo{.width_px = 1100, .height_px = 900, .pitch_px = pitch_px};
    EXPECT_THAT(Decode(Render(photo, other), board).observations, testing::IsEmpty()) << pitch_px << " px";
  }
}

TEST(Decoder, FindsNothingInNoise) {
  Frame frame;
  frame.width_px = 300;
  frame.height_px = 300;
  frame.format = PixelFormat::kRgb8;
  std::mt19937 random(3);
  auto bytes = std::make_shared<std::vector<uint8_t>>(3 * 300 * 300);
  for (uint8_t& b : *bytes) b = static_cast<uint8_t>(random() & 255);
  frame.pixels = bytes;
  EXPECT_THAT(Decode(frame).observations, testing::IsEmpty());
}

TEST(Decoder, ReportsEveryNodeOnceInOrder) {
  const DecodeResult result = Decode(Render({}, TestBoard().board()));
  ASSERT_GT(result.observations.size(), 1000u);
  const auto key = [](const Observation& o) { return std::tuple(o.node.kind, o.node.row, o.node.col); };
  for (size_t k = 1; k < result.observations.size(); ++k) {
    EXPECT_LT(key(result.observations[k - 1]), key(result.observations[k]));
  }
}

TEST(Decoder, LeavesCornersOutOnRequest) {
  DecodeOptions options;
  options.corners = false;
  const DecodeResult result = Decode(Render({}, TestBoard().board()), TestBoard(), options);
  EXPECT_THAT(OfKind(result, NodeKind::kCorner), testing::IsEmpty());
  EXPECT_GT(result.observations.size(), 1000u);
}

TEST(Decoder, SaysWhatBecameOfEveryPatch) {
  const DecodeResult result = Decode(Render({.mirrored = true}, TestBoard().board()));
  ASSERT_FALSE(result.patches.empty());
  bool mirrored = false;
  for (const PatchReport& patch : result.patches) {
    EXPECT_FALSE(patch.accepted);
    EXPECT_FALSE(patch.reason.empty());
    mirrored |= patch.reason == "mirrored";
  }
  EXPECT_TRUE(mirrored);
}

TEST(Decoder, ExplainsWhereGrowthStopsOnRequest) {
  // Part of the board is printed: growth stops at its border, and every cell tells the piece it came from.
  const Photograph photo{.row = 15, .col = 20, .rows = 30, .cols = 30};
  const Frame frame = Render(photo, TestBoard().board());
  DecodeOptions options;
  options.explain = true;
  const DecodeResult result = Decode(frame, TestBoard(), options);
  const size_t cells = OfKind(result, NodeKind::kCenter).size();
  ASSERT_GT(cells, 500u);
  EXPECT_EQ(result.explanation.groups.size(), cells);
  ASSERT_FALSE(result.explanation.missing.empty());
  int beyond = 0;
  for (const MissingCell& cell : result.explanation.missing) {
    EXPECT_THAT(result.observations,
                testing::Not(testing::Contains(
                    testing::Field(&Observation::node, BoardNode{cell.row, cell.col, NodeKind::kCenter}))));
    EXPECT_FALSE(Describe(cell.why).empty());
    beyond += !Printed(photo, TestBoard().board(), cell.row, cell.col);
  }
  EXPECT_GT(beyond, 50);
  const DecodeResult plain = Decode(frame);
  EXPECT_TRUE(plain.explanation.missing.empty() && plain.explanation.groups.empty());
  EXPECT_EQ(plain.observations.size(), result.observations.size());
}

TEST(Decoder, GivesTheSameBytesInParallel) {
  const Frame frame = Render({}, TestBoard().board());
  const DecodeResult alone = Decode(frame);
  DecodeResult together[2];
  {
    std::jthread first([&] { together[0] = Decode(frame); });
    std::jthread second([&] { together[1] = Decode(frame); });
  }
  for (const DecodeResult& result : together) {
    ASSERT_EQ(result.observations.size(), alone.observations.size());
    for (size_t k = 0; k < alone.observations.size(); ++k) {
      EXPECT_EQ(result.observations[k].x_px, alone.observations[k].x_px);
      EXPECT_EQ(result.observations[k].y_px, alone.observations[k].y_px);
      EXPECT_EQ(result.observations[k].sigma_px, alone.observations[k].sigma_px);
      EXPECT_EQ(result.observations[k].confidence, alone.observations[k].confidence);
    }
  }
}

TEST(Decoder, ImagesWithoutRoomForCellsAreEmpty) {
  for (const int side : {1, 2, 3, 8, 9, 12, 17}) {
    Frame frame;
    frame.width_px = side;
    frame.height_px = 30 - side;
    frame.format = PixelFormat::kRgb8;
    frame.pixels = std::make_shared<std::vector<uint8_t>>(3 * static_cast<size_t>(side) * (30 - side), 90);
    EXPECT_THAT(Decode(frame).observations, testing::IsEmpty());
  }
}

TEST(Decoder, RefusesGreyAndEmptyFrames) {
  Frame frame;
  EXPECT_FALSE(DecodeView(frame, TestBoard(), {}).ok());
  frame.width_px = frame.height_px = 20;
  frame.origin = "left.png";
  frame.pixels = std::make_shared<std::vector<uint8_t>>(400, 0);
  const auto status = DecodeView(frame, TestBoard(), {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("left.png"));
}

TEST(Decoder, RefusesOptionsOutOfRange) {
  const Frame frame = Render({.width_px = 40, .height_px = 40}, TestBoard().board());
  const auto refused = [&](auto change) {
    DecodeOptions options;
    change(&options);
    return DecodeView(frame, TestBoard(), options).status().code() == absl::StatusCode::kInvalidArgument;
  };
  EXPECT_TRUE(refused([](DecodeOptions* o) { o->levels = 0; }));
  EXPECT_TRUE(refused([](DecodeOptions* o) { o->keypoints.min_contrast = NAN; }));
  EXPECT_TRUE(refused([](DecodeOptions* o) { o->lattice.max_stretch = NAN; }));
  EXPECT_TRUE(refused([](DecodeOptions* o) { o->patches.min_margin = NAN; }));
  EXPECT_TRUE(refused([](DecodeOptions* o) { o->growth.fit.min_explained = NAN; }));
  EXPECT_TRUE(refused([](DecodeOptions* o) { o->confidence.min_to_stay = NAN; }));
  EXPECT_TRUE(refused([](DecodeOptions* o) { o->confidence.min_to_help = 1; }));
}

}  // namespace
}  // namespace weft
