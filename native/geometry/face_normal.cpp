// Compiled without fused multiply-adds (CMakeLists.txt), and for that reason calls no inline
// arithmetic of others.
#include <cmath>

#include "geometry/gather_mesh.h"

namespace pharos {

Vec3 face_normal(const Vec3& a, const Vec3& b, const Vec3& c) {
    const float ux = b.x - a.x;
    const float uy = b.y - a.y;
    const float uz = b.z - a.z;
    const float vx = c.x - a.x;
    const float vy = c.y - a.y;
    const float vz = c.z - a.z;
    const float x = uy * vz - uz * vy;
    const float y = uz * vx - ux * vz;
    const float z = ux * vy - uy * vx;
    const float length = std::sqrt(x * x + y * y + z * z);
    if (!(length > 0.0f)) {
        return Vec3(0.0f, 0.0f, 0.0f);
    }
    return Vec3(x / length, y / length, z / length);
}

}  // namespace pharos
