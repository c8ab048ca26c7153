// The elastic sheet: energy of a cloth of triangles, its forces and their derivative.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "absl/status/status.h"
#include "alignment/mesh.h"

namespace weft {

// Cotton jersey by default.
struct JerseyOptions {
  double density_kg_m2 = 0.18;
  double stretch_n_per_m = 400;    // along rows and columns of the board, per width
  double compression_share = 0.3;  // of that when shortened: a knit gives way
  double shear_n_per_m = 60;
  double locks_at = 0.1;         // strain from which on the loops lock and stiffness rises
  double bending_n_m = 2e-5;     // per width
  double damping_s = 1e-3;       // of deformation, relative to its stiffness
  double air_drag_per_s = 1.0;   // share of the velocity lost per second
  double friction = 0.35;        // coefficient, on body and cloth
  double thickness_cells = 0.3;  // at which layers push each other away

  absl::Status Validate() const;
};

// An edge along which the cloth is bent at rest: pressed, or curled as knits are at their hems. Angle between
// the normals of its two faces, above 0 where the edge stands out on the outer side.
struct Crease {
  int a = 0, b = 0;  // vertices of the edge
  double angle_rad = 0;
};

// Units: mm, kg, s; so forces are in kg mm/s^2 and stiffness per width in kg/s^2 (= N/m).
// Membrane: Baraff and Witkin 1998 (stretch along both threads, shear) with constant strain per face.
// Stress grows linearly up to `locks_at` and with the square of the strain beyond, and with the cube of
// shear. Bending: the quadratic energy of Bergou et al. 2006 for sheets that are flat at rest. A cylinder
// has the energy of a plate of that stiffness, up to 22 % more or less by direction. Creases: the same
// energy of the difference from the bent rest, with the normal between the edge's faces (Garg et al. 2007
// in spirit).
class Fabric {
 public:
  // flat_mm: [faces], the corners of each face at rest; the two sides of a seam may differ. Creases on edges
  // that are not between two faces have no effect.
  Fabric(int vertices, const std::vector<Face>& faces,
         const std::vector<std::array<Eigen::Vector2d, 3>>& flat_mm, const JerseyOptions& options,
         const std::vector<Crease>& creases = {});

  int vertices() const { return static_cast<int>(mass_kg_.size()); }
  const std::vector<double>& mass_kg() const { return mass_kg_; }

  // Forces and the stiffness matrix at x, both kept for the calls below. The matrix is positive
  // semidefinite: terms by which compressed cloth buckles are left out.
  void Linearize(const std::vector<Eigen::Vector3d>& x_mm);
  const std::vector<Eigen::Vector3d>& forces() const { return forces_; }
  // out = K p, [vertices].
  void Multiply(const std::vector<Eigen::Vector3f>& p, std::vector<Eigen::Vector3f>& out) const;
  Eigen::Matrix3f Diagonal(int vertex) const;

  // kg mm^2/s^2.
  double MembraneEnergy(const std::vector<Eigen::Vector3d>& x_mm) const;
  double BendingEnergy(const std::vector<Eigen::Vector3d>& x_mm) const;

  // Stretch of each face along columns and rows of the board, 1 at rest.
  std::vector<std::array<double, 2>> Stretches(const std::vector<Eigen::Vector3d>& x_mm) const;

 private:
  // Row v of a sparse matrix: entries [first[v], first[v + 1]), ordered by column.
  struct Pattern {
    std::vector<int> first, column;
    int Find(int row, int col) const;
    static Pattern Of(int rows, std::vector<std::array<int, 2>> entries);
  };
  struct Triangle {
    std::array<int, 3> v;
    std::array<float, 3> a, b;  // gradients of the corners' weights along x and y of the board, 1/mm
    float area_mm2 = 0;
  };
  struct TriangleState {
    Eigen::Matrix3f pu, pv;  // stiffness along the two threads
    Eigen::Vector3f wu, wv;
    float shear = 0;
    Eigen::Vector3d tu, tv;  // stress of the two threads times area
  };
  struct Corner {
    int face, corner;
    std::array<int, 3> entry;  // in the row of the corner's vertex, per corner of the face
  };

  // Two faces at an edge: ends of the edge, then the corners opposite it.
  struct Hinge {
    std::array<int, 4> v;
    std::array<double, 4> weight;  // their sum with the positions is the bend, a vector along the normal
    double stiffness = 0;
    double length_mm = 0;
  };
  // Of a hinge with a crease: the rest bend is `rest` times the normal.
  struct BentHinge {
    Hinge hinge;
    double rest = 0;
    std::array<std::array<int, 3>, 2> faces;  // corners, counter-clockwise seen from outside
  };
  struct BentCorner {
    int hinge;
    double weight;
  };

  void AddBending(const std::vector<Face>& faces, const std::vector<std::array<Eigen::Vector2d, 3>>& flat_mm,
                  const std::vector<Crease>& creases);
  void AddCreases();
  static Eigen::Vector3d NormalOf(const BentHinge& hinge, const std::vector<Eigen::Vector3d>& x_mm);
  void EvaluateFaces(const std::vector<Eigen::Vector3d>& x_mm);

  JerseyOptions options_;
  std::vector<double> mass_kg_;
  std::vector<Triangle> triangles_;
  std::vector<TriangleState> state_;  // [faces]
  std::vector<int> corner_first_;     // [vertices + 1] into corners_
  std::vector<Corner> corners_;
  Pattern membrane_, bending_;
  std::vector<Eigen::Matrix3f> block_;  // of membrane_
  std::vector<float> bend_;             // of bending_
  std::vector<BentHinge> bent_;
  std::vector<Eigen::Vector3d> pull_;  // of each bent hinge, times the weight of a vertex: its force
  std::vector<int> bent_first_;        // [vertices + 1] into bent_corners_
  std::vector<BentCorner> bent_corners_;
  std::vector<Eigen::Vector3d> forces_;
};

}  // namespace weft
