#include "services/formats/figure/bvh_hierarchy.h"

#include <algorithm>
#include <optional>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// People with fingers, faces and hair have some hundreds.
constexpr size_t kMostJoints = 4096;

constexpr std::array<std::string_view, 9> kChannelNames = {"xposition", "yposition", "zposition",
                                                           "xrotation", "yrotation", "zrotation",
                                                           "xscale",    "yscale",    "zscale"};

std::optional<BvhChannel> ChannelNamed(std::string_view word) {
  const auto at = std::ranges::find(kChannelNames, LowerCase(word));
  if (at == kChannelNames.end()) return std::nullopt;
  return static_cast<BvhChannel>(at - kChannelNames.begin());
}

class HierarchyReader {
 public:
  explicit HierarchyReader(BvhText& text) : text_(text) {}

  absl::StatusOr<BvhHierarchy> Read() {
    if (!text_.Take("hierarchy"))
      return absl::InvalidArgumentError("is not BVH; it does not begin with HIERARCHY");
    while (!text_.AtEnd() && !text_.Take("motion")) WEFT_RETURN_IF_ERROR(ReadPart());
    if (!open_.empty()) return text_.Error("ends or moves on within a joint; a closing brace is missing");
    if (out_.joints.empty()) return text_.Error("has no ROOT");
    return std::move(out_);
  }

 private:
  absl::Status ReadPart() {
    if (text_.Take("root")) {
      if (!out_.joints.empty())
        return text_.ErrorBefore(absl::StrCat("a second ROOT, \"", std::string(text_.RestOfLine()),
                                              "\"; one person is read, leave the others out of the file"));
      return Begin(text_.RestOfLine(), "ROOT");
    }
    if (open_.empty()) return text_.Error(absl::StrCat("expected ROOT or MOTION, found \"", Shown(), "\""));
    if (text_.Take("joint")) return Begin(text_.RestOfLine(), "JOINT");
    if (text_.Take("end") || text_.Take("endsite")) {
      text_.RestOfLine();  // "Site", and a name that nobody needs
      return Begin("", "");
    }
    if (text_.Take("offset")) return ReadOffset();
    if (text_.Take("channels")) return ReadChannels();
    if (text_.Take("}")) {
      open_.pop_back();
      return absl::OkStatus();
    }
    return text_.Error(
        absl::StrCat("expected OFFSET, CHANNELS, JOINT, End Site or }, found \"", Shown(), "\""));
  }

  std::string Shown() const { return std::string(text_.Peek().substr(0, 40)); }

  // A joint, or the end of a limb, up to its opening brace.
  absl::Status Begin(std::string_view name, std::string_view keyword) {
    if (name.empty() && !keyword.empty())
      return text_.ErrorBefore(absl::StrCat("a ", std::string(keyword), " without a name"));
    if (out_.joints.size() >= kMostJoints)
      return text_.ErrorBefore(absl::StrCat("more than ", kMostJoints, " joints"));
    out_.joints.push_back({std::string(name), open_.empty() ? -1 : static_cast<int>(open_.back())});
    out_.channels.emplace_back();
    open_.push_back(out_.joints.size() - 1);
    return text_.Expect("{");
  }

  absl::Status ReadOffset() {
    for (int k = 0; k < 3; ++k) {
      WEFT_ASSIGN_OR_RETURN(out_.joints[open_.back()].offset[k], text_.Number("the offset of a joint"));
    }
    return absl::OkStatus();
  }

  // The names count, as in other importers; their number says the same once more.
  absl::Status ReadChannels() {
    WEFT_ASSIGN_OR_RETURN(const double count, text_.Number("the number of channels"));
    std::vector<BvhChannel>& channels = out_.channels[open_.back()];
    const size_t before = channels.size();
    while (const std::optional<BvhChannel> channel = ChannelNamed(text_.Peek())) {
      if (std::ranges::find(channels, *channel) != channels.end())
        return text_.Error(absl::StrCat("channel ", Shown(), " stands twice at a joint"));
      channels.push_back(*channel);
      text_.Next();
    }
    const size_t found = channels.size() - before;
    out_.numbers += found;
    if (static_cast<double>(found) < count)
      return text_.Error(absl::StrCat("CHANNELS says ", count, ", but has ", found, " names; \"", Shown(),
                                      "\" is no channel (Xposition, Yrotation and so on)"));
    if (static_cast<double>(found) > count)
      out_.notes.push_back(absl::StrCat("\"", out_.joints[open_.back()].name, "\" has ", found,
                                        " channels where CHANNELS says ", count, "; all were read"));
    return absl::OkStatus();
  }

  BvhText& text_;
  BvhHierarchy out_;
  std::vector<size_t> open_;  // joints whose closing brace is to come
};

}  // namespace

absl::StatusOr<BvhHierarchy> ReadBvhHierarchy(BvhText& text) { return HierarchyReader(text).Read(); }

}  // namespace weft
