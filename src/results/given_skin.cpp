#include "repose/results/given_skin.h"

#include "repose/base/error.h"
#include "unfinished_file.h"
#include "writer.h"

namespace repose::results {

void add_given_skin(const std::filesystem::path& file, const GivenSkin& skin) {
  UnfinishedFile whole(file);
  std::error_code error;
  std::filesystem::copy_file(file, whole.part(), std::filesystem::copy_options::overwrite_existing,
                             error);
  if (error)
    base::refuse("{}: cannot be copied: {}; free space or choose another -output", file.string(),
                 error.message());
  base::Hdf5File h5 = base::open_hdf5(whole.part(), MPI_COMM_SELF);
  if (base::hdf5_has(h5, "/given_skin")) return;
  {
    const base::Hdf5Group group = base::create_hdf5_group(h5, "given_skin");
    write_array(group, "points", skin.points);
    write_array(group, "triangles", skin.triangles);
    write_array(group, "displacement", skin.displacement);
    write_array(group, "solved", skin.solved);
  }
  h5.close();
  whole.commit();
}

}  // namespace repose::results
