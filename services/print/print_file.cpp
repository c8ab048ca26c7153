#include "services/print/print_file.h"

#include <cairo-pdf.h>
#include <cairo-svg.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/imgcodecs.hpp>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "services/print/print_drawing.h"

namespace weft {
namespace {

constexpr double kPointsPerMm = 72 / 25.4;
constexpr double kMmPerInch = 25.4;
constexpr int kMaxImagePx = 32767;  // of cairo

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

Surface Own(cairo_surface_t* surface) { return Surface(surface, &cairo_surface_destroy); }

absl::Status StatusOf(cairo_status_t status, const std::string& path) {
  if (status == CAIRO_STATUS_SUCCESS) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(path, ": cannot be written: ", cairo_status_to_string(status)));
}

// The page onto a surface with so many units per mm.
absl::Status Draw(const Board& board, const PrintLayout& layout, size_t number, double units_per_mm,
                  cairo_surface_t* surface, const std::string& path) {
  const Context context(cairo_create(surface), &cairo_destroy);
  cairo_scale(context.get(), units_per_mm, units_per_mm);
  DrawPrintPage(board, layout, number, context.get());
  cairo_show_page(context.get());
  return StatusOf(cairo_status(context.get()), path);
}

absl::Status WritePdf(const Board& board, const PrintLayout& layout, const std::string& path,
                      const std::function<void(size_t)>& progress) {
  const Surface surface = Own(cairo_pdf_surface_create(path.c_str(), 1, 1));
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE,
                                 absl::StrCat("weft board ", board.ContentHash()).c_str());
  for (size_t k = 1; k <= layout.pages.size(); ++k) {
    const PrintPage& page = layout.pages[k - 1];
    cairo_pdf_surface_set_size(surface.get(), page.width_mm * kPointsPerMm, page.height_mm * kPointsPerMm);
    if (absl::Status status = Draw(board, layout, k, kPointsPerMm, surface.get(), path); !status.ok())
      return status;
    if (progress) progress(k);
  }
  cairo_surface_finish(surface.get());
  return StatusOf(cairo_surface_status(surface.get()), path);
}

absl::Status WriteSvg(const Board& board, const PrintLayout& layout, size_t number, const std::string& path) {
  const PrintPage& page = layout.pages[number - 1];
  const Surface surface = Own(
      cairo_svg_surface_create(path.c_str(), page.width_mm * kPointsPerMm, page.height_mm * kPointsPerMm));
  cairo_svg_surface_set_document_unit(surface.get(), CAIRO_SVG_UNIT_PT);
  if (absl::Status status = Draw(board, layout, number, kPointsPerMm, surface.get(), path); !status.ok())
    return status;
  cairo_surface_finish(surface.get());
  return StatusOf(cairo_surface_status(surface.get()), path);
}

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
  const Surface surface = Own(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height));
  {
    const Context context(cairo_create(surface.get()), &cairo_destroy);
    cairo_set_source_rgb(context.get(), 1, 1, 1);
    cairo_paint(context.get());
  }
  if (absl::Status status = Draw(board, layout, number, px_per_mm, surface.get(), path); !status.ok())
    return status;
  cairo_surface_flush(surface.get());
  const uint8_t* data = cairo_image_surface_get_data(surface.get());
  const int stride = cairo_image_surface_get_stride(surface.get());
  cv::Mat image(height, width, CV_8UC3);
  for (int y = 0; y < height; ++y) {
    const uint32_t* from = reinterpret_cast<const uint32_t*>(data + static_cast<size_t>(y) * stride);
    uint8_t* to = image.ptr(y);
    for (int x = 0; x < width; ++x, to += 3) {
      to[0] = static_cast<uint8_t>(from[x]);
      to[1] = static_cast<uint8_t>(from[x] >> 8);
      to[2] = static_cast<uint8_t>(from[x] >> 16);
    }
  }
  constexpr int kInches = 2, kLzw = 5;
  const int rounded = static_cast<int>(std::lround(dpi));
  try {
    if (cv::imwrite(path, image,
                    {cv::IMWRITE_TIFF_RESUNIT, kInches, cv::IMWRITE_TIFF_XDPI, rounded, cv::IMWRITE_TIFF_YDPI,
                     rounded, cv::IMWRITE_TIFF_COMPRESSION, kLzw}))
      return absl::OkStatus();
  } catch (const cv::Exception&) {
  }
  return absl::UnavailableError(absl::StrCat(path, ": cannot be written"));
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
  if (absl::Status status = options.Validate(); !status.ok()) return status;
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
    if (absl::Status status = WritePdf(board, layout, path, progress); !status.ok()) return status;
    return std::vector<std::string>{path};
  }
  std::vector<std::string> files;
  for (size_t k = 1; k <= layout.pages.size(); ++k) {
    files.push_back(PagePath(path, k));
    absl::Status status = tiff ? WriteTiff(board, layout, k, options.dpi, files.back())
                               : WriteSvg(board, layout, k, files.back());
    if (!status.ok()) return status;
    if (progress) progress(k);
  }
  return files;
}

}  // namespace weft
