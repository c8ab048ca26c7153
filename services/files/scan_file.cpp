#include "services/files/scan_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <sstream>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "services/files/atomic_file.h"
#include "services/files/mesh_file.h"
#include "services/files/ply.h"

namespace weft {
namespace {

constexpr std::array<const char*, 6> kPcdFields = {"x", "y", "z", "normal_x", "normal_y", "normal_z"};

absl::Status Bad(const std::string& path, const std::string& why) {
  return absl::InvalidArgumentError(absl::StrCat(path, ": ", why));
}

// Normals of length 1, or none at all.
void TidyNormals(Scan& scan) {
  for (Eigen::Vector3d& n : scan.normals) {
    const double largest = n.cwiseAbs().maxCoeff();
    if (!n.allFinite() || largest == 0) {
      scan.normals.clear();
      return;
    }
    n = (n / largest).normalized();  // squares of very short or long normals are no doubles
  }
}

absl::StatusOr<Scan> ScanFromPly(const std::string& path) {
  const absl::StatusOr<Ply> ply = ReadPly(path);
  if (!ply.ok()) return ply.status();
  const auto vertex = FindElement(*ply, "vertex", path);
  if (!vertex.ok()) return vertex.status();
  auto positions = PositionsFromPly(**vertex, path);
  if (!positions.ok()) return positions.status();
  Scan scan;
  scan.points_mm = *std::move(positions);
  const PlyProperty* normals[3] = {(*vertex)->Find("nx"), (*vertex)->Find("ny"), (*vertex)->Find("nz")};
  for (const PlyProperty* column : normals) {
    if (!column || column->is_list) return scan;
  }
  for (size_t i = 0; i < scan.points_mm.size(); ++i) {
    scan.normals.emplace_back(normals[0]->values[i], normals[1]->values[i], normals[2]->values[i]);
  }
  TidyNormals(scan);
  return scan;
}

struct PcdHeader {
  std::vector<std::string> fields;
  std::vector<int> bytes;  // of a field, all its counts together
  std::vector<int> counts;
  size_t points = 0;
  bool binary = false;
  size_t data_at = 0;
};

absl::StatusOr<PcdHeader> ParsePcdHeader(const std::string& text, const std::string& path) {
  PcdHeader header;
  std::vector<int> sizes;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    const std::vector<std::string> words =
        absl::StrSplit(text.substr(at, end - at), absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
    at = end + 1;
    if (words.empty() || words[0][0] == '#') continue;
    const std::vector<std::string> rest(words.begin() + 1, words.end());
    const auto numbers = [&rest] {
      std::vector<int> out(rest.size(), -1);
      for (size_t i = 0; i < rest.size(); ++i) (void)absl::SimpleAtoi(rest[i], &out[i]);
      return out;
    };
    if (words[0] == "FIELDS") header.fields = rest;
    if (words[0] == "SIZE") sizes = numbers();
    if (words[0] == "COUNT") header.counts = numbers();
    if (words[0] == "POINTS" && (rest.size() != 1 || !absl::SimpleAtoi(rest[0], &header.points))) {
      return Bad(path, "POINTS is no count");
    }
    if (words[0] != "DATA") continue;
    if (rest.empty() || (rest[0] != "ascii" && rest[0] != "binary")) {
      return Bad(path, "DATA is neither ascii nor binary; convert it with pcl_convert_pcd_ascii_binary");
    }
    header.binary = rest[0] == "binary";
    header.data_at = std::min(at, text.size());
    break;
  }
  if (header.data_at == 0) return Bad(path, "is no PCD file: it has no line DATA");
  if (header.counts.empty()) header.counts.assign(header.fields.size(), 1);
  if (sizes.size() != header.fields.size() || header.counts.size() != header.fields.size()) {
    return Bad(path, "FIELDS, SIZE and COUNT differ in length");
  }
  for (size_t i = 0; i < sizes.size(); ++i) {
    if (sizes[i] < 1 || sizes[i] > 8 || header.counts[i] < 1 || header.counts[i] > 4096) {
      return Bad(path, absl::StrCat("SIZE or COUNT of the field ", header.fields[i], " is out of range"));
    }
    const bool wanted = std::find(kPcdFields.begin(), kPcdFields.end(), header.fields[i]) != kPcdFields.end();
    if (wanted && (header.counts[i] != 1 || (sizes[i] != 4 && sizes[i] != 8))) {
      return Bad(path, absl::StrCat("the field ", header.fields[i], " must be one float or double a point"));
    }
    header.bytes.push_back(sizes[i] * header.counts[i]);
  }
  return header;
}

template <typename T>
double ValueAt(const std::string& text, size_t at) {
  T value;
  std::memcpy(&value, text.data() + at, sizeof(T));
  return value;
}

// Columns of the wanted fields that are there.
absl::StatusOr<std::map<std::string, std::vector<double>>> PcdColumns(const std::string& text,
                                                                      const PcdHeader& header,
                                                                      const std::string& path) {
  std::map<std::string, std::vector<double>> columns;
  size_t stride = 0;
  for (const int bytes : header.bytes) stride += bytes;
  const size_t left = text.size() - header.data_at;
  if (header.binary && (stride == 0 || left / stride < header.points)) return Bad(path, "is truncated");
  if (!header.binary && left < header.points) return Bad(path, "is truncated");
  std::istringstream words(header.binary ? std::string() : text.substr(header.data_at));
  for (size_t point = 0; point < header.points; ++point) {
    size_t at = header.data_at + point * stride;
    for (size_t f = 0; f < header.fields.size(); ++f) {
      double value = 0;
      if (header.binary) {
        if (header.bytes[f] == 4) value = ValueAt<float>(text, at);
        if (header.bytes[f] == 8) value = ValueAt<double>(text, at);
        at += header.bytes[f];
      } else {
        std::string word;
        for (int i = 0; i < header.counts[f]; ++i) {
          if (!(words >> word)) return Bad(path, absl::StrCat("ends before point ", point));
          if (i == 0 && !absl::SimpleAtod(word, &value)) value = std::nan("");
        }
      }
      for (const char* wanted : kPcdFields) {
        if (header.fields[f] == wanted) columns[wanted].push_back(value);
      }
    }
  }
  return columns;
}

}  // namespace

absl::StatusOr<Scan> ParsePcd(const std::string& bytes, const std::string& source_name) {
  const absl::StatusOr<PcdHeader> header = ParsePcdHeader(bytes, source_name);
  if (!header.ok()) return header.status();
  auto columns = PcdColumns(bytes, *header, source_name);
  if (!columns.ok()) return columns.status();
  const auto has = [&](const char* name) { return (*columns)[name].size() == header->points; };
  if (!has("x") || !has("y") || !has("z")) return Bad(source_name, "has no fields x y z");
  const bool normals = has("normal_x") && has("normal_y") && has("normal_z");
  Scan scan;
  for (size_t i = 0; i < header->points; ++i) {
    const Eigen::Vector3d p((*columns)["x"][i], (*columns)["y"][i], (*columns)["z"][i]);
    if (!p.allFinite()) continue;  // PCD marks points without a measurement so
    scan.points_mm.push_back(p);
    if (normals) {
      scan.normals.emplace_back((*columns)["normal_x"][i], (*columns)["normal_y"][i],
                                (*columns)["normal_z"][i]);
    }
  }
  TidyNormals(scan);
  return scan;
}

absl::StatusOr<Scan> ReadScan(const std::string& path) {
  if (!absl::EndsWithIgnoreCase(path, ".pcd")) return ScanFromPly(path);
  const absl::StatusOr<std::string> bytes = ReadWholeFile(path);
  return bytes.ok() ? ParsePcd(*bytes, path) : bytes.status();
}

}  // namespace weft
