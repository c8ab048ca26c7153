#include "services/studio/print/print_file.h"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "capture/image/image_encoders.h"
#include "services/formats/files/atomic_file.h"
#include "services/studio/print/print_drawing.h"
#include "services/studio/print/vector_file.h"

namespace weft {
namespace {

constexpr double kMmPerInch = 25.4;
constexpr int kMaxImagePx = 32767;  // of cairo

absl::Status WriteTiff(const Board& board, const PrintLayout& layout, size_t number, double dpi,
                       const std::string& path) {
  const PrintPage& page = layout.pages[number - 1];
  const double px_per_mm = dpi / kMmPerInch;
  const double longest = std::max(page.width_mm, page.height_mm) * px_per_mm;
  if (longest > kMaxImagePx) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": a page of ", std::lround(page.width_mm), " x ", std::lround(page.height_mm),
                     " mm at ", dpi, " dpi has more than ", kMaxImagePx, " pixels a side; print at ",
                     std::floor(dpi * kMaxImagePx / longest), " dpi, in smaller pages, or as PDF"));
  }
  const int width = static_cast<int>(std::lround(page.width_mm * px_per_mm)),
            height = static_cast<int>(std::lround(page.height_mm * px_per_mm));
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height), &cairo_surface_destroy);
  const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context(cairo_create(surface.get()),
                                                                   &cairo_destroy);
  cairo_set_source_rgb(context.get(), 1, 1, 1);
  cairo_paint(context.get());
  cairo_scale(context.get(), px_per_mm, px_per_mm);
  DrawPrintPage(board, layout, number, context.get());
  if (const cairo_status_t drawn = cairo_status(context.get()); drawn != CAIRO_STATUS_SUCCESS)
    return absl::UnavailableError(absl::StrCat(path, ": cannot be drawn: ", cairo_status_to_string(drawn)));
  cairo_surface_flush(surface.get());
  const uint8_t* data = cairo_image_surface_get_data(surface.get());
  const int stride = cairo_image_surface_get_stride(surface.get());
  std::vector<uint8_t> rgb(static_cast<size_t>(width) * static_cast<size_t>(height) * 3);
  uint8_t* to = rgb.data();
  for (int y = 0; y < height; ++y) {
    const uint32_t* from = reinterpret_cast<const uint32_t*>(data + static_cast<size_t>(y) * stride);
    for (int x = 0; x < width; ++x)
      for (const int shift : {16, 8, 0}) *to++ = static_cast<uint8_t>(from[x] >> shift);
  }
  WEFT_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes,
                        Naming(path, EncodeTiff({width, height, 3, 8, rgb}, dpi)));
  return WriteFileAtomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

std::string PagePath(const std::string& path, size_t number) {
  if (number == 1) return path;
  const std::filesystem::path whole(path);
  return (whole.parent_path() / absl::StrCat(whole.stem().string(), "-", number, whole.extension().string()))
      .string();
}

}  // namespace

absl::Status PrintFileOptions::Validate() const {
  if (!(dpi >= 10 && dpi <= 4800) || dpi != std::floor(dpi))
    return absl::InvalidArgumentError("dpi must be a whole number in 10 to 4800");
  return absl::OkStatus();
}

absl::StatusOr<std::vector<std::string>> WritePrintFiles(const Board& board, const PrintLayout& layout,
                                                         const std::string& path,
                                                         const PrintFileOptions& options,
                                                         const std::function<void(size_t)>& progress) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  const std::string ending = absl::AsciiStrToLower(std::filesystem::path(path).extension().string());
  const bool tiff = ending == ".tif" || ending == ".tiff";
  if (ending != ".pdf" && ending != ".svg" && !tiff)
    return absl::InvalidArgumentError(absl::StrCat(path, ": a print is a .pdf, .svg or .tif file"));
  if (const auto folder = std::filesystem::path(path).parent_path(); !folder.empty()) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) return absl::UnavailableError(absl::StrCat(folder.string(), ": ", error.message()));
  }
  if (ending == ".pdf") {
    std::vector<PageSize> pages;
    for (const PrintPage& page : layout.pages) pages.push_back({page.width_mm, page.height_mm});
    WEFT_RETURN_IF_ERROR(WritePdf(path, absl::StrCat("weft board ", board.ContentHash()), pages,
                                  [&](size_t page, cairo_t* context) {
                                    DrawPrintPage(board, layout, page + 1, context);
                                    if (progress) progress(page + 1);
                                  }));
    return std::vector<std::string>{path};
  }
  std::vector<std::string> files;
  for (size_t k = 1; k <= layout.pages.size(); ++k) {
    files.push_back(PagePath(path, k));
    const PageSize size{layout.pages[k - 1].width_mm, layout.pages[k - 1].height_mm};
    WEFT_RETURN_IF_ERROR(tiff ? WriteTiff(board, layout, k, options.dpi, files.back())
                              : WriteSvg(files.back(), size, [&](cairo_t* context) {
                                  DrawPrintPage(board, layout, k, context);
                                }));
    if (progress) progress(k);
  }
  return files;
}

}  // namespace weft
