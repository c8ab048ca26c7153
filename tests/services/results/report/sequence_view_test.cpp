#include "services/results/report/sequence_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// What stands between two texts.
std::string Between(const std::string& html, const std::string& begin, const std::string& end,
                    size_t from = 0) {
  const size_t at = html.find(begin, from);
  EXPECT_NE(at, std::string::npos) << begin;
  if (at == std::string::npos) return "";
  const size_t start = at + begin.size();
  return html.substr(start, html.find(end, start) - start);
}

std::vector<uint8_t> Unpacked(const std::string& base64) {
  std::string bytes;
  EXPECT_TRUE(absl::Base64Unescape(base64, &bytes));
  return {bytes.begin(), bytes.end()};
}

SequenceFrame FrameOf(const std::string& name, float shift) {
  return {name,
          "",
          {{shift, 100, 1200}, {shift + 300, 100, 1200}, {shift, 600.5f, 1200}},
          {{1, 0, 2}, {0, 254, 255}}};
}

SequenceView View() {
  return {{{4, 7, 9}, {{0, 1, 2}}},
          {ColoringByState(), ColoringByValue("sigma", "sigma", "mm", {0, 0.5})},
          Viewpoint(),
          30};
}

TEST(SequenceView, PositionsComeBackToSixteenBits) {
  SequenceView view = View();
  view.Add(FrameOf("0001", 0));
  view.Add(FrameOf("0002", 41.7f));
  const std::string html = view.Data();
  const size_t second = html.find("data-name=\"0002\"");
  double step = 0;
  ASSERT_TRUE(absl::SimpleAtod(Between(html, "data-step=\"", "\"", second), &step));
  EXPECT_NEAR(step, 500.5 / 65535, 1e-9);
  const std::vector<uint8_t> bytes = Unpacked(Between(html, "\">", "</script>", second));
  ASSERT_EQ(bytes.size(), 3u * 6 + 2 * 3);
  std::array<uint16_t, 9> words{};
  std::memcpy(words.data(), bytes.data(), sizeof(words));
  std::vector<double> center;
  for (const auto text : absl::StrSplit(Between(html, "data-center=\"", "\"", second), ' ')) {
    center.emplace_back();
    ASSERT_TRUE(absl::SimpleAtod(text, &center.back()));
  }
  // Relative to the mean of the frame's vertices.
  const std::vector<Eigen::Vector3f> given = FrameOf("", 41.7f).vertices_mm;
  const Eigen::Vector3f mean = (given[0] + given[1] + given[2]) / 3;
  for (int v = 0; v < 3; ++v)
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(words[3 * v + axis] * step - center[axis], (given[v] - mean)[axis], 0.5 * step + 1e-4);
  EXPECT_THAT(std::vector<uint8_t>(bytes.begin() + 18, bytes.end()), ElementsAre(1, 0, 2, 0, 254, 255));
}

TEST(SequenceView, PartsCanBeShownAlone) {
  SequenceView view({{4, 7, 9}, {{0, 1, 2}, {2, 1, 0}, {1, 2, 0}}}, {ColoringByState()}, Viewpoint(), 30);
  view.Add({"0001", "", FrameOf("", 0).vertices_mm, {{1, 0, 2}}});
  EXPECT_THAT(view.Section({}, ""), Not(HasSubstr("class=\"parts\"")));
  view.SetParts({{"skirt", 2}, {"shirt", 1}});
  EXPECT_THAT(view.Section({}, ""),
              HasSubstr("<select class=\"parts\"><option>all</option><option data-first=\"0\" "
                        "data-faces=\"2\">skirt</option><option data-first=\"2\" data-faces=\"1\">shirt"));
}

TEST(SequenceView, FacesAndFramesAreTold) {
  SequenceView view = View();
  view.Add(FrameOf("0001", 0));
  SequenceFrame bridged = FrameOf("<b>", 1);
  bridged.note = "bridged";
  view.Add(bridged);
  const std::string html = view.Section({"Frame 1", "png", 20, 10}, "3 of 10 vertices") + view.Data();
  EXPECT_THAT(Unpacked(Between(html, "class=\"sequence-faces\">", "<")), ElementsAre(0, 0, 1, 0, 2, 0));
  EXPECT_THAT(html, HasSubstr("max=\"1\""));
  EXPECT_THAT(html, HasSubstr("data-vertices=\"3\""));
  EXPECT_THAT(html, HasSubstr("data-name=\"&lt;b&gt;\" data-note=\"bridged\""));
  EXPECT_THAT(html, HasSubstr("src=\"data:image/png;base64,cG5n\""));
  EXPECT_THAT(html, HasSubstr("3 of 10 vertices"));
  EXPECT_EQ(view.kept(), (std::vector<int>{4, 7, 9}));
  EXPECT_EQ(View().Section({}, ""), "");
}

TEST(SequenceView, PalettesAreTheColoursOfThePictures) {
  EXPECT_EQ(ColoringByState().palette[1], StateColor(VertexState::kObserved));
  EXPECT_EQ(ColoringByState().palette[3], StateColor(VertexState::kBridged));
  EXPECT_EQ(ColoringByState().palette[4], StateColor(VertexState::kDriven));
  const SequenceColoring sigma = ColoringByValue("sigma", "sigma", "mm", {0, 2});
  for (const double value : {0.0, 0.7, 1.3, 2.0, 5.0}) {
    const Eigen::Vector3f shown = sigma.palette[PaletteIndex(value, {0, 2})],
                          drawn = ScalarColors({value}, {0, 2})[0];
    EXPECT_LT((shown - drawn).norm(), 0.01) << value;
  }
  EXPECT_EQ(sigma.palette[PaletteIndex(std::numeric_limits<double>::quiet_NaN(), {0, 2})], UnknownColor());
}

TEST(SequenceView, LongTakesAreThinnedSoThatPagesOpenAtOnce) {
  EXPECT_THAT(SequenceFrames(3), ElementsAre(0, 1, 2));
  const std::vector<size_t> shown = SequenceFrames(5000);
  ASSERT_EQ(shown.size(), 300u);
  EXPECT_EQ(shown.front(), 0u);
  EXPECT_EQ(shown.back(), 4999u);
  for (size_t i = 1; i < shown.size(); ++i) EXPECT_NEAR(shown[i] - shown[i - 1], 4999 / 299.0, 1);
  for (const size_t frames : {1, 20, 100, 300, 5000}) {
    for (const size_t colorings : {2, 5}) {
      const size_t vertices = SequenceVertices(frames, colorings);
      EXPECT_LE(vertices, 65'536u);
      EXPECT_GE(vertices, 5'000u);
      EXPECT_LT(4.0 / 3 * vertices * (6 + colorings) * std::min<size_t>(frames, 300), 25e6);
    }
  }
}

TEST(SequenceView, TheProgramLoadsNothingAndCannotEndItsOwnElement) {
  for (const char* what : {"</script", "<!--", "http", "import", "fetch(", "eval(", "innerHTML"})
    EXPECT_THAT(SequenceProgram(View()).script, Not(HasSubstr(what)));
}

}  // namespace
}  // namespace weft
