#include "services/studio/print/vector_file.h"

#include <cairo-pdf.h>
#include <cairo-svg.h>

#include <memory>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"

namespace weft {
namespace {

constexpr double kPointsPerMm = 72 / 25.4;

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;

cairo_status_t Append(void* text, const unsigned char* bytes, unsigned int size) {
  static_cast<std::string*>(text)->append(reinterpret_cast<const char*>(bytes), size);
  return CAIRO_STATUS_SUCCESS;
}

absl::Status StatusOf(cairo_status_t status, const std::string& path) {
  if (status == CAIRO_STATUS_SUCCESS) return absl::OkStatus();
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

absl::Status Finish(cairo_surface_t* surface, const std::string& bytes, const std::string& path) {
  cairo_surface_finish(surface);
  const absl::Status status = StatusOf(cairo_surface_status(surface), path);
  return status.ok() ? WriteFileAtomically(path, bytes) : status;
}

}  // namespace

absl::Status WritePdf(const std::string& path, const std::string& title, const std::vector<PageSize>& pages,
                      const std::function<void(size_t, cairo_t*)>& draw) {
  std::string bytes;  // outlives the surface
  const Surface surface(cairo_pdf_surface_create_for_stream(&Append, &bytes, 1, 1), &cairo_surface_destroy);
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, title.c_str());
  for (size_t i = 0; i < pages.size(); ++i) {
    cairo_pdf_surface_set_size(surface.get(), pages[i].width_mm * kPointsPerMm,
                               pages[i].height_mm * kPointsPerMm);
    WEFT_RETURN_IF_ERROR(DrawPage(surface.get(), path, [&](cairo_t* context) { draw(i, context); }));
  }
  return Finish(surface.get(), bytes, path);
}

absl::Status WriteSvg(const std::string& path, const PageSize& page,
                      const std::function<void(cairo_t*)>& draw) {
  std::string bytes;
  const Surface surface(cairo_svg_surface_create_for_stream(&Append, &bytes, page.width_mm * kPointsPerMm,
                                                            page.height_mm * kPointsPerMm),
                        &cairo_surface_destroy);
  cairo_svg_surface_set_document_unit(surface.get(), CAIRO_SVG_UNIT_PT);
  WEFT_RETURN_IF_ERROR(DrawPage(surface.get(), path, draw));
  return Finish(surface.get(), bytes, path);
}

}  // namespace weft
