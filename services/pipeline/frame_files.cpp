#include "services/pipeline/frame_files.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/checksum.h"
#include "services/files/atomic_file.h"
#include "services/files/cloud_file.h"
#include "services/files/json_file.h"
#include "services/files/mesh_file.h"
#include "services/files/observations_file.h"

namespace weft {
namespace {

constexpr char kReport[] = "report.json";
// Those that a report lists.
constexpr std::array<const char*, 4> kListed = {"mesh.ply", "unrefined.ply", "cloud.ply", "observations.csv"};

std::vector<ImageObservations> ByImage(const RegistrationInputs& inputs, const FrameResult& frame) {
  std::vector<ImageObservations> images;
  for (const ViewObservations& view : frame.views) {
    images.push_back({inputs.rig.cameras[view.camera].id, view.observations});
  }
  return images;
}

absl::Status RemoveOldFiles(const ConfinedFolder& folder) {
  absl::Status status = folder.Remove(kReport);
  for (const char* name : kListed) status.Update(folder.Remove(name));
  return status;
}

// Writes the data files of the frame and lists them in `report`.
absl::Status WriteData(const ConfinedFolder& folder, const RegistrationInputs& inputs,
                       const FrameResult& frame, v1::FrameReport& report) {
  absl::Status status;
  const auto write = [&](const std::string& name, const auto& writer) {
    if (status.ok()) status = writer(folder.At(name));
    if (status.ok()) status = ListFile(folder, name, report);
  };
  const auto write_mesh = [&](const MeshTexture& texture) {
    return [&](const std::string& path) {
      return WriteRegisteredMesh(path, *frame.mesh, inputs.garment.rest.faces, texture);
    };
  };
  if (report.options().write_observations()) {
    write("observations.csv",
          [&](const std::string& path) { return WriteObservations(path, ByImage(inputs, frame)); });
  }
  write("cloud.ply", [&](const std::string& path) { return WriteCloud(path, frame.cloud); });
  if (frame.mesh) write("mesh.ply", write_mesh(inputs.texture));
  if (frame.mesh && !report.options().frames_alone()) write("unrefined.ply", write_mesh({}));
  return status;
}

// Calls `write` with the frame's folder, and again when somebody removed it meanwhile.
template <typename Write>
absl::Status IntoFrameFolder(const std::string& out, const std::string& frame, const Write& write) {
  constexpr int kTries = 5;
  absl::Status status;
  for (int i = 0; i < kTries; ++i) {
    if (i > 0) std::this_thread::sleep_for(std::chrono::milliseconds(50));
    const auto folder = OpenFrameFolder(out, frame, ConfinedFolder::IfMissing::kMake);
    status = folder.ok() ? folder->InWords(write(*folder)) : folder.status();
    if (!absl::IsNotFound(status)) break;
  }
  return status;
}

std::string Hex(uint64_t checksum) { return absl::StrFormat("%016x", checksum); }

const v1::ResultFile* FindListed(const v1::FrameReport& report, const std::string& name) {
  const auto found = std::find_if(report.files().begin(), report.files().end(),
                                  [&name](const v1::ResultFile& file) { return file.name() == name; });
  return found == report.files().end() ? nullptr : &*found;
}

void RemoveTemporaryFilesOf(const ConfinedFolder& folder, const std::vector<std::string>& files) {
  const auto names = folder.Names();
  if (!names.ok()) return;
  for (const std::string& name : *names) {
    const bool temporary = std::any_of(files.begin(), files.end(), [&name](const std::string& file) {
      return IsTemporaryNameOf(name, file);
    });
    if (temporary) folder.Remove(name).IgnoreError();
  }
}

}  // namespace

absl::StatusOr<ConfinedFolder> OpenFrameFolder(const std::string& out, const std::string& frame,
                                               ConfinedFolder::IfMissing missing) {
  absl::StatusOr<ConfinedFolder> base = ConfinedFolder::Open(out);
  if (absl::IsNotFound(base.status()) && missing == ConfinedFolder::IfMissing::kMake) {
    if (absl::Status status = CreateFolders(out); !status.ok()) return status;
    base = ConfinedFolder::Open(out);
  }
  if (!base.ok()) return base.status();
  return base->Child(frame, missing);
}

absl::Status WriteFrame(const std::string& out, const RegistrationInputs& inputs, const FrameResult& frame) {
  return IntoFrameFolder(out, frame.report.frame(), [&](const ConfinedFolder& folder) {
    if (absl::Status status = RemoveOldFiles(folder); !status.ok()) return status;
    v1::FrameReport report = frame.report;
    report.set_format_version(kReportFormat);
    if (absl::Status status = WriteData(folder, inputs, frame, report); !status.ok()) return status;
    return WriteReport(folder, report);
  });
}

absl::Status WriteReportAlone(const std::string& out, v1::FrameReport report) {
  report.set_format_version(kReportFormat);
  report.clear_files();
  return IntoFrameFolder(out, report.frame(), [&](const ConfinedFolder& folder) {
    if (absl::Status status = RemoveOldFiles(folder); !status.ok()) return status;
    return WriteReport(folder, report);
  });
}

absl::Status WriteReport(const ConfinedFolder& folder, const v1::FrameReport& report) {
  return folder.InWords(WriteJsonFile(folder.At(kReport), report));
}

void UnlistFile(const std::string& name, v1::FrameReport& report) {
  auto& files = *report.mutable_files();
  files.erase(std::remove_if(files.begin(), files.end(),
                             [&name](const v1::ResultFile& file) { return file.name() == name; }),
              files.end());
}

absl::Status ListFile(const ConfinedFolder& folder, const std::string& name, v1::FrameReport& report) {
  UnlistFile(name, report);
  const absl::StatusOr<std::string> bytes = folder.Read(name);
  if (!bytes.ok()) return bytes.status();
  v1::ResultFile& file = *report.add_files();
  file.set_name(name);
  file.set_bytes(static_cast<int64_t>(bytes->size()));
  file.set_checksum(Hex(Checksum(bytes->data(), bytes->size())));
  return absl::OkStatus();
}

std::string CheckFile(const ConfinedFolder& folder, const std::string& name, const v1::FrameReport& report) {
  const v1::ResultFile* listed = FindListed(report, name);
  const absl::StatusOr<std::string> bytes = folder.Read(name);
  if (absl::IsNotFound(bytes.status())) return listed ? absl::StrCat(name, " is missing") : "";
  if (!bytes.ok()) return std::string(bytes.status().message());
  if (!listed) return absl::StrCat(name, " is not of this run");
  const bool same = static_cast<int64_t>(bytes->size()) == listed->bytes() &&
                    Hex(Checksum(bytes->data(), bytes->size())) == listed->checksum();
  return same ? "" : absl::StrCat(name, " is not as it was written");
}

std::string CheckFiles(const ConfinedFolder& folder, const v1::FrameReport& report) {
  for (const char* name : kListed) {
    if (std::string problem = CheckFile(folder, name, report); !problem.empty()) return problem;
  }
  return "";
}

absl::StatusOr<v1::FrameReport> ReadReport(const ConfinedFolder& folder) {
  const absl::StatusOr<std::string> text = folder.Read(kReport);
  if (!text.ok()) return text.status();
  v1::FrameReport report;
  if (!ParseJson(*text, folder.Named(kReport), report).ok() || report.format_version() != kReportFormat) {
    return absl::NotFoundError(absl::StrCat(folder.path(), " holds no complete frame"));
  }
  return report;
}

void RemoveTemporaryFiles(const std::string& out, const std::vector<std::string>& frames) {
  const auto base = ConfinedFolder::Open(out);
  if (!base.ok()) return;
  RemoveTemporaryFilesOf(*base, {"job.json", "report.html"});
  std::vector<std::string> files(kListed.begin(), kListed.end());
  files.emplace_back(kReport);
  for (const std::string& frame : frames) {
    const auto folder = base->Child(frame, ConfinedFolder::IfMissing::kFail);
    if (folder.ok()) RemoveTemporaryFilesOf(*folder, files);
  }
}

}  // namespace weft
