#include "capture/image/image_size.h"

#include <cstdio>
#include <string>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace weft {
namespace {

constexpr char kPayload[] = "weft/image-sizes";

}  // namespace

std::string SizeText(const ImageSize& size) { return absl::StrCat(size.width_px, "x", size.height_px); }

absl::Status WrongSizeError(const std::string& where, const WrongSize& sizes) {
  absl::Status status = absl::InvalidArgumentError(
      absl::StrCat("image is ", SizeText(sizes.found), ", the rig says ", SizeText(sizes.expected)));
  status.SetPayload(kPayload, absl::Cord(absl::StrCat(SizeText(sizes.found), " ", SizeText(sizes.expected))));
  return where.empty() ? status : StatusAt(where, status);
}

std::optional<WrongSize> WrongSizeOf(const absl::Status& status) {
  const auto payload = status.GetPayload(kPayload);
  if (!payload) return std::nullopt;
  WrongSize sizes;
  const bool is_whole =
      std::sscanf(std::string(*payload).c_str(), "%dx%d %dx%d", &sizes.found.width_px, &sizes.found.height_px,
                  &sizes.expected.width_px, &sizes.expected.height_px) == 4;
  return is_whole ? std::optional(sizes) : std::nullopt;
}

absl::Status StatusAt(const std::string& where, const absl::Status& status) {
  absl::Status out(status.code(), absl::StrCat(where, ": ", status.message()));
  status.ForEachPayload(
      [&](absl::string_view type, const absl::Cord& payload) { out.SetPayload(type, payload); });
  return out;
}

}  // namespace weft
