// The acceleration structures of single meshes, kept while a scene is edited: an accelerator that
// is given them builds only what is new, and brings every mesh into the scene by its matrix.
//
// Meshes are known by Mesh::version. Used by one accelerator's construction at a time; what was
// built lives on in the accelerators that use it.
#pragma once

#include <cstddef>
#include <memory>

namespace pharos {

class MeshTrees {
  public:
    MeshTrees();
    ~MeshTrees();
    MeshTrees(const MeshTrees&) = delete;
    MeshTrees& operator=(const MeshTrees&) = delete;

    [[nodiscard]] std::size_t size() const;  // meshes of the last accelerator

    struct Impl;  // the accelerator's own

    [[nodiscard]] Impl& impl() { return *impl_; }

  private:
    std::unique_ptr<Impl> impl_;
};

}  // namespace pharos
