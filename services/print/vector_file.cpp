#include "services/print/vector_file.h"

#include <cairo-pdf.h>
#include <cairo-svg.h>

#include <cerrno>
#include <memory>

#include "absl/strings/str_cat.h"
#include "capture/file/posix_file.h"

namespace weft {
namespace {

constexpr double kPointsPerMm = 72 / 25.4;

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;

absl::Status StatusOf(cairo_status_t status, const std::string& path) {
  if (status == CAIRO_STATUS_SUCCESS) return absl::OkStatus();
  // Cairo does not say why, the system does.
  if (status == CAIRO_STATUS_WRITE_ERROR && errno != 0) return FileError(path, "cannot be written", errno);
  return absl::UnavailableError(absl::StrCat(path, ": cannot be written: ", cairo_status_to_string(status)));
}

absl::Status DrawPage(cairo_surface_t* surface, const std::string& path,
                      const std::function<void(cairo_t*)>& draw) {
  const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context(cairo_create(surface), &cairo_destroy);
  cairo_scale(context.get(), kPointsPerMm, kPointsPerMm);
  draw(context.get());
  cairo_show_page(context.get());
  return StatusOf(cairo_status(context.get()), path);
}

}  // namespace

absl::Status WritePdf(const std::string& path, const std::string& title, const std::vector<PageSize>& pages,
                      const std::function<void(size_t, cairo_t*)>& draw) {
  errno = 0;
  const Surface surface(cairo_pdf_surface_create(path.c_str(), 1, 1), &cairo_surface_destroy);
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, title.c_str());
  for (size_t i = 0; i < pages.size(); ++i) {
    cairo_pdf_surface_set_size(surface.get(), pages[i].width_mm * kPointsPerMm,
                               pages[i].height_mm * kPointsPerMm);
    absl::Status status = DrawPage(surface.get(), path, [&](cairo_t* context) { draw(i, context); });
    if (!status.ok()) return status;
  }
  cairo_surface_finish(surface.get());
  return StatusOf(cairo_surface_status(surface.get()), path);
}

absl::Status WriteSvg(const std::string& path, const PageSize& page,
                      const std::function<void(cairo_t*)>& draw) {
  errno = 0;
  const Surface surface(
      cairo_svg_surface_create(path.c_str(), page.width_mm * kPointsPerMm, page.height_mm * kPointsPerMm),
      &cairo_surface_destroy);
  cairo_svg_surface_set_document_unit(surface.get(), CAIRO_SVG_UNIT_PT);
  if (absl::Status status = DrawPage(surface.get(), path, draw); !status.ok()) return status;
  cairo_surface_finish(surface.get());
  return StatusOf(cairo_surface_status(surface.get()), path);
}

}  // namespace weft
