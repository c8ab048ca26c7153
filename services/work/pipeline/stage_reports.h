// What the stages did, as messages of the report.
#pragma once

#include <string>

#include "alignment/align.h"
#include "alignment/map_place.h"
#include "alignment/template.h"
#include "pattern/decoder.h"
#include "services/formats/pcd/scan_file.h"
#include "triangulation/camera_bias.h"
#include "triangulation/cloud.h"
#include "weft/v1/report.pb.h"

namespace weft {

// Counts of nodes and patches, reasons of rejection, times. Fields of the reading stay as they are.
void DescribeDecoding(const DecodeResult& result, v1::ViewReport& report);

// Counts, reasons, medians.
void DescribeCloud(const Cloud& cloud, v1::CloudReport& report);

// Nothing for a camera without observations.
void DescribeBias(const CameraBias& bias, v1::ViewReport& report);

// Size of the cloud against print and template.
void DescribeScale(const Cloud& cloud, const Board& board, const Template& garment, v1::CloudReport& report);

// Vertices, those with a cell, observed and by two views, coverage, median sigma; of each garment, too.
void DescribeMesh(const RegisteredMesh& mesh, const Template& garment, v1::MeshReport& report);

// DescribeMesh, stages, self-intersections. `unclaimed`: points of the cloud that no vertex claims.
void DescribeAlignment(const AlignResult& result, const Template& garment, int unclaimed,
                       v1::MeshReport& report);

void DescribePlace(const MapPlace& place, v1::MapPlaceReport& report);

// A scan, and what the alignment made of it.
void DescribeScan(const ScanFile& file, const ScanUse& use, v1::ScanReport& report);

// "40,000 points, 39,000 of them found a vertex ...": what an operator has to know of a scan.
std::string ScanText(const v1::ScanReport& report);

}  // namespace weft
