#include "services/formats/files/agreement_proto.h"

namespace weft {
namespace {

const char* TurnText(ImageTurn turn) {
  switch (turn) {
    case ImageTurn::kUpsideDown:
      return "upside down";
    case ImageTurn::kMirrored:
      return "mirrored";
    case ImageTurn::kMirroredUpsideDown:
      return "mirrored and upside down";
    default:
      return "";
  }
}

}  // namespace

void DescribeAgreement(const CameraAgreement& agreement, const Rig& rig, v1::ViewReport& report) {
  if (agreement.compared == 0) return;
  v1::CameraAgreement& out = *report.mutable_agreement();
  out.set_compared(agreement.compared);
  out.set_agreeing(agreement.agreeing);
  out.set_median_px(agreement.median_px);
  out.set_common_px(agreement.common_px);
  out.set_scale(agreement.scale);
  out.set_scale_sigma(agreement.scale_sigma);
  out.set_perspective(agreement.perspective);
  out.set_perspective_sigma(agreement.perspective_sigma);
  if (!agreement.fits) return;
  out.set_fits_turned(TurnText(agreement.fits->turn));
  if (agreement.fits->turn == ImageTurn::kNone) {
    out.set_fits_camera(rig.cameras[agreement.fits->camera].id);
    out.set_fits_part(std::string(CameraPartName(agreement.fits->part)));
  }
  out.set_fits_px(agreement.fits->median_px);
}

}  // namespace weft
