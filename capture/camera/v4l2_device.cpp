#include "capture/camera/v4l2_device.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "base/natural_order.h"
#include "base/status_macros.h"
#include "capture/camera/v4l2_ioctl.h"

namespace weft {
namespace {

constexpr double kRateTolerance = 0.005;  // cameras of 29.97 frames per second say 30

template <size_t size>
std::string TextOf(const uint8_t (&field)[size]) {
  const auto* text = reinterpret_cast<const char*>(field);
  return {text, strnlen(text, size)};
}

// Of the USB device that the video device belongs to.
std::string SerialOf(const std::string& path) {
  std::error_code error;
  const std::filesystem::path real = std::filesystem::canonical(path, error);
  std::filesystem::path at =
      std::filesystem::canonical("/sys/class/video4linux/" + real.filename().string() + "/device", error);
  for (int level = 0; level < 2 && !error; ++level, at = at.parent_path()) {
    std::ifstream file(at / "serial");
    std::string serial;
    if (std::getline(file, serial)) return serial;
  }
  return "";
}

std::vector<std::string> VideoPaths() {
  std::vector<std::string> paths;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", error))
    if (const std::string name = entry.path().filename(); absl::StartsWith(name, "video"))
      paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end(), NaturalLess);
  return paths;
}

bool IsCamera(int fd, v4l2_capability& capability) {
  if (V4l2Ioctl(fd, VIDIOC_QUERYCAP, &capability) != 0) return false;
  const uint32_t has = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps
                                                                             : capability.capabilities;
  capability.device_caps = has;
  return (has & (V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE)) != 0;
}

absl::StatusOr<std::string> PathOf(const std::string& camera_id, const std::string& device) {
  if (absl::StartsWith(device, "/")) return device;
  std::vector<std::string> matches, all;
  for (const V4l2Identity& camera : FindV4l2Cameras()) {
    all.push_back(absl::StrCat(camera.path, " (", camera.card, ", ", camera.bus, ")"));
    if (device == camera.bus || device == camera.card) matches.push_back(camera.path);
  }
  if (matches.size() == 1) return matches.front();
  const std::string found =
      all.empty() ? "none is there" : absl::StrCat("found are ", absl::StrJoin(all, ", "));
  if (matches.empty())
    return absl::NotFoundError(absl::StrCat("camera ", camera_id, ": no V4L2 camera is called ", device,
                                            " by card or bus; ", found));
  return absl::InvalidArgumentError(absl::StrCat("camera ", camera_id, ": ", matches.size(),
                                                 " V4L2 cameras are called ", device,
                                                 "; name one by its bus or path: ", found));
}

absl::Status NotOpened(const std::string& camera_id, const std::string& path, int error) {
  const std::string start = absl::StrCat("camera ", camera_id, ": ", path, ": ");
  if (error == ENOENT || error == ENODEV || error == ENXIO)
    return absl::NotFoundError(absl::StrCat(start, "there is no such device; is the camera plugged in?"));
  if (error == EACCES || error == EPERM)
    return absl::PermissionDeniedError(
        absl::StrCat(start, "may not be opened; `usermod -aG video $USER` and log in again"));
  return absl::UnavailableError(absl::StrCat(start, "cannot be opened: ", std::strerror(error)));
}

}  // namespace

int V4l2Ioctl(int fd, unsigned long request, void* argument) {
  int result;
  do result = ioctl(fd, request, argument);
  while (result != 0 && errno == EINTR);
  return result;
}

V4l2Device::V4l2Device(V4l2Device&& other) noexcept
    : id_(std::move(other.id_)), fd_(std::exchange(other.fd_, -1)), identity_(std::move(other.identity_)) {}

V4l2Device::~V4l2Device() {
  if (fd_ >= 0) close(fd_);
}

absl::Status V4l2Device::Refused(const std::string& what) const {
  return absl::InvalidArgumentError(absl::StrCat("camera ", id_, " (", identity_.path, "): ", what));
}

absl::Status V4l2Device::Failed(const std::string& what) const {
  return absl::UnavailableError(
      absl::StrCat("camera ", id_, " (", identity_.path, "): ", what, ": ", std::strerror(errno)));
}

absl::StatusOr<V4l2Device> V4l2Device::Open(const std::string& camera_id, const std::string& device) {
  WEFT_ASSIGN_OR_RETURN(const std::string path, PathOf(camera_id, device));
  const int fd = open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return NotOpened(camera_id, path, errno);
  V4l2Device opened(camera_id, fd);
  WEFT_RETURN_IF_ERROR(opened.Identify(path));
  return opened;
}

absl::Status V4l2Device::Identify(const std::string& path) {
  identity_.path = path;
  v4l2_capability capability{};
  if (!IsCamera(fd_, capability))
    return Refused("it is no V4L2 camera; `weft camera list` shows those there are");
  identity_ = {path, TextOf(capability.driver), TextOf(capability.card), TextOf(capability.bus_info),
               SerialOf(path)};
  if ((capability.device_caps & V4L2_CAP_VIDEO_CAPTURE) == 0)
    return Refused("its images come in several planes (multi-planar API), which Weft does not take");
  if ((capability.device_caps & V4L2_CAP_STREAMING) == 0)
    return Refused("it cannot stream into buffers (no V4L2_CAP_STREAMING)");
  return absl::OkStatus();
}

std::string V4l2Device::Sizes(uint32_t code) const {
  std::vector<std::string> sizes;
  v4l2_frmsizeenum size{};
  size.pixel_format = code;
  for (; V4l2Ioctl(fd_, VIDIOC_ENUM_FRAMESIZES, &size) == 0; ++size.index) {
    if (size.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
      sizes.push_back(absl::StrCat(size.discrete.width, "x", size.discrete.height));
      continue;
    }
    const v4l2_frmsize_stepwise& range = size.stepwise;
    sizes.push_back(absl::StrCat(range.min_width, "x", range.min_height, " to ", range.max_width, "x",
                                 range.max_height, " in steps of ", range.step_width, "x",
                                 range.step_height));
    break;
  }
  return absl::StrJoin(sizes, ", ");
}

std::vector<std::string> V4l2Device::Formats() const {
  std::vector<std::string> formats;
  v4l2_fmtdesc description{};
  description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  for (; V4l2Ioctl(fd_, VIDIOC_ENUM_FMT, &description) == 0; ++description.index) {
    const std::string code = V4l2CodeText(description.pixelformat);
    const absl::StatusOr<RawFormat> format = RawFormatOfV4l2(description.pixelformat);
    formats.push_back(format.ok() ? absl::StrCat(std::string(RawFormatName(*format)), " (", code, ") ",
                                                 Sizes(description.pixelformat))
                                  : absl::StrCat("[", code, "]"));
  }
  return formats;
}

absl::StatusOr<V4l2Image> V4l2Device::SetImage(const std::string& format, int width_px, int height_px) {
  v4l2_format wanted{};
  wanted.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (V4l2Ioctl(fd_, VIDIOC_G_FMT, &wanted) != 0) return Failed("it does not say how its images are");
  v4l2_pix_format& pixels = wanted.fmt.pix;
  v4l2_fmtdesc description{};
  description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  uint32_t code = format.empty() && RawFormatOfV4l2(pixels.pixelformat).ok() ? pixels.pixelformat : 0;
  for (; code == 0 && V4l2Ioctl(fd_, VIDIOC_ENUM_FMT, &description) == 0; ++description.index) {
    const absl::StatusOr<RawFormat> has = RawFormatOfV4l2(description.pixelformat);
    if (has.ok() &&
        (format.empty() || RawFormatName(*has) == format || V4l2CodeText(description.pixelformat) == format))
      code = description.pixelformat;
  }
  if (code == 0)
    return Refused(
        absl::StrCat("it has no images of format ", format, "; it has ", absl::StrJoin(Formats(), "; ")));
  const uint32_t width = width_px > 0 ? static_cast<uint32_t>(width_px) : pixels.width;
  const uint32_t height = height_px > 0 ? static_cast<uint32_t>(height_px) : pixels.height;
  pixels = {};
  pixels.pixelformat = code;
  pixels.width = width;
  pixels.height = height;
  pixels.field = V4L2_FIELD_NONE;
  if (V4l2Ioctl(fd_, VIDIOC_S_FMT, &wanted) != 0)
    return Failed(errno == EBUSY ? "it is streaming for another program" : "its image format cannot be set");
  if (pixels.pixelformat != code || pixels.width != width || pixels.height != height)
    return Refused(absl::StrCat("it has no images of ", width, "x", height, " in format ", V4l2CodeText(code),
                                "; it has ", Sizes(code)));
  if (RawBytes(*RawFormatOfV4l2(code), 8, 1) * width % 8 != 0)
    return Refused(
        absl::StrCat("lines of ", width, " packed pixels end inside a byte; choose another width"));
  if (pixels.field != V4L2_FIELD_NONE && pixels.field != V4L2_FIELD_ANY)
    return Refused(
        "it delivers interlaced images, whose lines are of two moments; choose a progressive input");
  V4l2Image image{*RawFormatOfV4l2(code), static_cast<int>(width), static_cast<int>(height),
                  pixels.bytesperline, pixels.sizeimage};
  if (image.format == RawFormat::kMotionJpeg) image.line_bytes = 0;
  return image;
}

std::string V4l2Device::Rates() const {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (V4l2Ioctl(fd_, VIDIOC_G_FMT, &format) != 0) return "";
  std::vector<std::string> rates;
  v4l2_frmivalenum interval{};
  interval.pixel_format = format.fmt.pix.pixelformat;
  interval.width = format.fmt.pix.width;
  interval.height = format.fmt.pix.height;
  const auto rate = [](const v4l2_fract& f) {
    return absl::StrFormat("%g", static_cast<double>(f.denominator) / f.numerator);
  };
  for (; V4l2Ioctl(fd_, VIDIOC_ENUM_FRAMEINTERVALS, &interval) == 0; ++interval.index) {
    if (interval.type == V4L2_FRMIVAL_TYPE_DISCRETE) {
      rates.push_back(rate(interval.discrete));
      continue;
    }
    rates.push_back(absl::StrCat(rate(interval.stepwise.max), " to ", rate(interval.stepwise.min)));
    break;
  }
  return absl::StrJoin(rates, ", ");
}

double V4l2Device::Rate() const {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (V4l2Ioctl(fd_, VIDIOC_G_PARM, &parameters) != 0) return 0;
  const v4l2_fract& frame = parameters.parm.capture.timeperframe;
  return frame.numerator > 0 ? static_cast<double>(frame.denominator) / frame.numerator : 0;
}

absl::Status V4l2Device::SetRate(double fps) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  parameters.parm.capture.timeperframe = {1000, static_cast<uint32_t>(std::lround(1000 * fps))};
  const bool is_set = V4l2Ioctl(fd_, VIDIOC_S_PARM, &parameters) == 0;
  const double rate = Rate();
  if (rate > 0 && std::abs(rate - fps) <= kRateTolerance * fps) return absl::OkStatus();
  const std::string rates = Rates();
  return Refused(absl::StrFormat("it does not film at %g frames per second%s%s%s", fps,
                                 rate > 0 ? absl::StrFormat(", but at %g", rate) : "",
                                 is_set ? "" : "; its driver sets no rates",
                                 rates.empty() ? "" : "; it has " + rates + " at this size"));
}

std::vector<V4l2Identity> FindV4l2Cameras() {
  std::vector<V4l2Identity> found;
  for (const std::string& path : VideoPaths()) {
    const int fd = open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) {
      if (errno == EACCES || errno == EPERM) found.push_back({path, "", "", "", ""});
      continue;
    }
    v4l2_capability capability{};
    if (IsCamera(fd, capability))
      found.push_back({path, TextOf(capability.driver), TextOf(capability.card), TextOf(capability.bus_info),
                       SerialOf(path)});
    close(fd);
  }
  return found;
}

}  // namespace weft
