"""Deliberate breaks of the program: what each is, the words in the sources that are exchanged
(they stand there once), and a pattern of the tests that are to catch it."""

MECHANICS, SOLVE, MODEL = r"^mechanics\.", r"^solve\.", r"^model\."
BREAKS = [
    # mechanics
    ("energy of the quadratic law", "(1.0 + 0.5 * q)", "(1.0 + 0.25 * q)", MECHANICS),
    (
        "tangent of the quartic law",
        "k0 * (1.0 + q) * (1.0 + 5.0 * q)",
        "k0 * (1.0 + q) * (1.0 + 4.0 * q)",
        MECHANICS,
    ),
    (
        "curvature of the quartic law",
        "4.0 * once * (3.0 + 5.0 * q)",
        "4.0 * once * (3.0 + 4.0 * q)",
        f"{MECHANICS}|{SOLVE}force_functional",
    ),
    (
        "volume of a prism",
        "volume = e.d.dot(normals) / 36.0",
        "volume = e.d.dot(normals) / 35.0",
        MECHANICS,
    ),
    (
        "a sign in the volume's second derivatives",
        "{{{o, p + a - g, q + a + g,",
        "{{{o, p + a + g, q + a + g,",
        MECHANICS,
    ),
    (
        "weight of the springs' forces",
        "const double tension = scale * spring_tension<p>(s, k0, inverse);",
        "const double tension = spring_tension<p>(s, k0, inverse);",
        MECHANICS,
    ),
    (
        "energy of an edge",
        "return 0.5 * (squares.xy[0]",
        "return 0.25 * (squares.xy[0]",
        MECHANICS,
    ),
    (
        "sign of the pressure",
        "state.pressure = -along.mean() - volume_slope;",
        "state.pressure = along.mean() - volume_slope;",
        MECHANICS,
    ),
    (
        "von Mises stress",
        "std::sqrt(1.5) * apart.norm()",
        "std::sqrt(1.0) * apart.norm()",
        MECHANICS,
    ),
    (
        "sign of the loads",
        "gradient[i] -= scale * load_force_[i];",
        "gradient[i] += scale * load_force_[i];",
        SOLVE,
    ),
    # the way of the bones
    (
        "tissue that folds passes",
        "attempt.folded = inverted(trial_) > folded_before;",
        "attempt.folded = false;",
        f"{SOLVE}load_path|extremes|load_steps",
    ),
    (
        "a step that misses its prediction passes",
        "constexpr double trusted_miss = 0.5;",
        "constexpr double trusted_miss = 1e9;",
        f"{SOLVE}load_path|load_steps",
    ),
    (
        "a step that fails is not halved",
        "if (!now.outcome.converged) return false;",
        "",
        f"{SOLVE}load_path|load_steps",
    ),
    (
        "a guess that folds is taken",
        "(outcome.converged && inverted(trial_) <= folded_before)",
        "outcome.converged",
        f"{SOLVE}load_path|nested|interrupt",
    ),
    ("a screw's translation", "load * along + part *", "along + part *", r"^scene\."),
    (
        "held points do not go",
        "return (1 - load) * from + load * model.points.target[row];",
        "return from;",
        f"{MODEL}motion|instruments",
    ),
    # how far
    (
        "estimate of half a step",
        "constexpr double safety = 2;     // the estimate",
        "constexpr double safety = 0.5;  // the estimate",
        f"{SOLVE}|extremes",
    ),
    (
        "no margin for soft points",
        "const double margin = positions_.part().solid ? 50 : 200;",
        "constexpr double margin = 0;",
        f"{SOLVE}|extremes",
    ),
    (
        "negative curvature is no matter",
        "return product >= 0 && reason != KSP_DIVERGED_INDEFINITE_MAT &&\n         reason != KSP_DIVERGED_INDEFINITE_PC;",
        "return true;",
        f"{SOLVE}|extremes",
    ),
    (
        "ten times the accuracy is enough",
        "outcome.converged = error_ <= accuracy_;",
        "outcome.converged = error_ <= 10 * accuracy_;",
        f"{SOLVE}|extremes",
    ),
    (
        "a trial step that says nothing is believed",
        "contraction_ = found <= trusted_contraction ? found : most_contraction;",
        "contraction_ = 0;",
        f"{SOLVE}|extremes",
    ),
    # initial equilibrium
    (
        "sign of the force to balance",
        "check(VecScale(force, -1));",
        "check(VecScale(force, 1));",
        f"{SOLVE}prestress",
    ),
    (
        "rest lengths below 0",
        "if (part.model.springs.rest_length[j] > 0) continue;",
        "continue;",
        f"{SOLVE}prestress|equilibrium|bad_input",
    ),
    (
        "turgor",
        "(skin[j] ? 1 + as.turgor : 1.0)",
        "(skin[j] ? 1 + 2 * as.turgor : 1.0)",
        f"{SOLVE}prestress|equilibrium",
    ),
    (
        "a solid's skin tension",
        "skin.young * tissue.turgor * thickness / (1 - skin.poisson)",
        "skin.young * tissue.turgor * thickness",
        f"{MODEL}|solid|equilibrium",
    ),
    # volume and stability
    (
        "volume kept to a hundredth",
        "pressure[e] / weight);",
        "0.5 * pressure[e] / weight);",
        f"{SOLVE}exact_volume",
    ),
    (
        "springs of the wrong volume",
        "constexpr int springs_of_prism = 15;",
        "constexpr int springs_of_prism = 9;",
        f"{MODEL}stiffness",
    ),
    # averaged volumes
    (
        "a point averages half its prisms' volumes",
        "const double change = share * sum[p], pressure",
        "const double change = 0.5 * share * sum[p], pressure",
        MECHANICS + "(derivatives|solid)",
    ),
    (
        "averaged volumes do not bend",
        "const Pair bend = weight * unit * (own * rate + above + below);",
        "const Pair bend = weight * unit * own * rate;",
        MECHANICS + "derivatives",
    ),
    (
        "averaged pressure is counted twice",
        "(nodal.empty() ? 0 : prisms.nodal_modulus[m]);\n    const double v0",
        "0;\n    const double v0",
        f"{MECHANICS}solid|{SOLVE}solid|program.continuum|program.check",
    ),
    (
        "Lamé's constants of incompressible tissue",
        "((1 + e.poisson) * (1 - 2 * e.poisson)) + shear}",
        "((1 + e.poisson) * (1 - 2 * e.poisson))}",
        MECHANICS + "solid",
    ),
    ("strata lie upon each other", "    top = bottom;\n", "", f"{MODEL}|program.material"),
    # contact
    (
        "contact found too late",
        "return found ? -1 : contact_margin;",
        "return found ? -1 : 0;",
        r"^surface\.collision|^model\.collision",
    ),
    (
        "distance of boxes too large",
        "const Vec3 in_a = between.cwiseAbs() - a.half - spread * b.half;",
        "const Vec3 in_a = between.cwiseAbs() - a.half;",
        r"^surface\.collision|^model\.collision",
    ),
    (
        "touching costs no energy",
        "value += touches_.area[c] * (now.value + before);",
        "value += touches_.area[c] * before;",
        r"^mechanics\.contact",
    ),
    (
        "the energy jumps where a point touches",
        "value += touches_.area[c] * (now.value + before);",
        "value += touches_.area[c] * now.value;",
        r"^mechanics\.contact",
    ),
    (
        "tissue sticks to bone",
        "if (!slides && !(pressure > 0))",
        "if (false)",
        r"^(mechanics|solve)\.contact",
    ),
    (
        "a body's curvature is no matter",
        "Mat3 bend = pressing.pressure * curvature_[c];",
        "Mat3 bend = 0 * curvature_[c];",
        r"^mechanics\.contact",
    ),
    (
        "points that come near are not looked at",
        "constexpr double steepest = 1.1;",
        "constexpr double steepest = 0;",
        r"^mechanics\.contact",
    ),
    (
        "a body's normals do not turn with it",
        "d.gradient = rotation_ * d.gradient;",
        "",
        r"^mechanics\.contact",
    ),
    (
        "a body pushes with its first guess for ever",
        "touches.set_multipliers(pressure);",
        "",
        r"^solve\.contact",
    ),
    (
        "what passes into bone is not in the estimate",
        "outcome.displacement_error += contact_safety * violation();",
        "",
        r"^solve\.contact",
    ),
    (
        "a penalty that is too soft stays so",
        "left > slow * least &&",
        "left > slow * least && false &&",
        r"^solve\.contact",
    ),
    (
        "the penetration is not told",
        "for (const double gap : touches.gaps()) deepest = std::max(deepest, -gap);",
        "",
        r"^solve\.contact|^program\.(contact|instruments)",
    ),
    (
        "the inside of a body is outside",
        "last_distance_ = inside ? -distance : distance;",
        "last_distance_ = inside ? distance : -distance;",
        r"^surface\.distance_field",
    ),
    (
        "a vertex on a grid line belongs to both its edges",
        "from.z() < z && to.z() >= z",
        "from.z() <= z && to.z() >= z",
        r"^surface\.distance_field",
    ),
    (
        "crossings before a point count, too",
        "static_cast<int>(side) * winding < 0",
        "static_cast<int>(side) * winding != 0",
        r"^surface\.distance_field",
    ),
    (
        "a sign reaches beyond the surface",
        "travel < std::abs(last_distance_)",
        "travel < 3 * std::abs(last_distance_)",
        r"^surface\.distance_field",
    ),
    (
        "a closer triangle than the last is missed",
        "(1 + 1e-9) * squared",
        "0.9 * squared",
        r"^surface\.distance_field",
    ),
    # mouth and cuts
    (
        "the lips face away from each other",
        "return outwards < 0;",
        "return outwards > 0;",
        r"^solve\.contact|^program\.(contact|incisions)",
    ),
    (
        "a surface of a cut bends nowhere",
        "(metric - foot.gap * curvature).inverse();",
        "metric.inverse();",
        r"^mechanics\.contact",
    ),
    (
        "splines end where their controls do",
        "of[end - first] += (beyond + 1) * weight;",
        "of[end - first] += weight;",
        r"^mechanics\.contact",
    ),
    (
        "both sides of a cut have the whole area",
        "touches.area[c] /= 2;",
        "",
        r"^model\.cut|^program\.(contact|incisions)",
    ),
    (
        "teeth reach no farther than their region",
        "return (x - sphere.center).norm() <= sphere.radius + near;",
        "return (x - sphere.center).norm() <= sphere.radius;",
        f"{MODEL}|^program\\.(contact|material)",
    ),
    # cutting
    (
        "a cut one layer too shallow",
        "if (p.layer[row] >= cut_.layers ||",
        "if (p.layer[row] + 1 >= cut_.layers ||",
        f"{MODEL}cut",
    ),
    (
        "loads at a cut go to the wrong side",
        "points.mass[row] *= 1 - share;",
        "points.mass[row] *= share;",
        f"{MODEL}cut",
    ),
    (
        "edges at a cut",
        "add_to_edge(p, q, (1 - share) * beyond[j]);",
        "add_to_edge(p, q, share * beyond[j]);",
        f"{MODEL}cut",
    ),
    (
        "springs tear at half the limit",
        "if (!(tension[j] > *result_.limit)) continue;",
        "if (!(tension[j] > 0.5 * *result_.limit)) continue;",
        f"{SOLVE}tearing|program.tearing",
    ),
    # files
    (
        "a file is renamed before it is whole",
        "if (!committed_) std::filesystem::remove(part_, ignored);",
        "",
        r"^results\.",
    ),
    ("a held name is taken", "if (!held && (knows_locks ||", "if (false && (knows_locks ||", r"^results\."),
    (
        "numbers that are not finite are read",
        "if (!std::isfinite(values[i]))\n      reader.refuse(",
        "if (false)\n      reader.refuse(",
        r"^results\.",
    ),
    (
        "springs of a point with itself",
        "  check.different(\"spring/points\", m.springs.points);\n",
        "",
        r"^results\.",
    ),
    (
        "a restart of another model",
        "if (stored.points.position != model.points.position)",
        "if (false)",
        r"^results\.|program.load_steps|interrupt",
    ),
    (
        "a restart from the first step",
        "step >= 0 && !is_rest(found.step.numbers); --step)",
        "step >= count && !is_rest(found.step.numbers); --step)",
        r"^results\.",
    ),
    (
        "a transform file the wrong way round",
        "return RigidMotion::from_matrix(matrix).inverse();",
        "return RigidMotion::from_matrix(matrix);",
        r"^scene\.",
    ),
    ("a reflection is a motion", "if (rotation.determinant() < 0)", "if (false)", r"^scene\."),
    (
        "a step that is missing is passed over",
        'if (!in.has(fmt::format("/step/{:04}", step)))',
        "if (false)",
        r"^results\.",
    ),
    (
        "arrays of any shape are read",
        "if (array.shape() == expected) return;",
        "return;",
        r"^results\.",
    ),
    (
        "a checkpoint passes for a result",
        'in.integer("/", "checkpoint") != 0;',
        'in.integer("/", "checkpoint") == 2;',
        r"^results\.|program.interrupt|program.check",
    ),
    (
        "a result's bulk modulus is forgotten",
        "return stored > 0 ? std::optional(stored) : std::nullopt;",
        "return std::nullopt;",
        r"^results\.|program.model_input|program.result",
    ),
    (
        "repose-check forgives",
        "row.wrong += !(difference <= tolerance_);",
        "row.wrong += 0;",
        r"^base\.comparison",
    ),
    (
        "a DICOM element may be longer than its file",
        "if (element.bytes > size - at)",
        "if (false)",
        r"^imaging\.volume_read",
    ),
    # options
    (
        "the range of a number is no matter",
        "return number && option.range.contains(*number);",
        "return number.has_value();",
        r"^base\.",
    ),
    ("unknown options are taken", "unknown_.push_back(name);\n    return is_value", "return is_value", r"^base\."),
    # parts that ranks make themselves
    (
        "a piece lacks its second ring",
        "triangles_at(on.mesh, columns_of(on.mesh, triangles_at(on.mesh, columns)))",
        "triangles_at(on.mesh, columns)",
        f"{SOLVE}on_",
    ),
    ("a column's rows are all its first", "begin[k] + next++", "begin[k] + 0 * next++", f"{SOLVE}on_"),
]
