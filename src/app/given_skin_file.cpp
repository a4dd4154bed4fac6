#include "given_skin_file.h"

#include "report.h"
#include "repose/adapt/given_skin.h"
#include "repose/base/agreement.h"
#include "repose/results/additions.h"
#include "repose/results/run_files.h"
#include "repose/surface/write.h"

namespace repose::app {

std::string write_given_skin(MPI_Comm comm, const Job& job, const std::string& name,
                             const SolvedSkin& skin, const std::vector<Vec3>& now) {
  if (!job.remeshed) return "";
  const std::string file = name + results::given_skin_ending;
  base::on_root(comm, [&] {
    std::vector<Vec3> displacement(now.size());
    for (size_t i = 0; i < now.size(); ++i) displacement[i] = now[i] - skin.initial().points[i];
    const surface::Surface& given = *job.anatomy->given_skin;
    const surface::PointData data =
        adapt::displacement_of_given(given, skin.initial(), displacement);
    surface::write_surface(file, given, data);
    results::add_given_skin(name + ".h5", {given.points, given.triangles, data.vectors[0].values,
                                           data.fields[0].values});
  });
  return report_row("given skin", file + ", and in the result: its vertices, with displacement");
}

}  // namespace repose::app
