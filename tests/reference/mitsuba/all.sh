#!/bin/sh
# Renders the references named by the arguments, or all, into this folder (about 25 minutes on one core).
# Mitsuba's own rough materials have the separable G; its Schlick and the correlated G come from bsdf.py.
cd "$(dirname "$0")" && python3 variants.py || exit 1
wanted="$*"
one() {
    name=$1 scene=$2 spp=$3 ggx=$4
    test -z "$wanted" || case " $wanted " in *" $name "*) ;; *) return ;; esac
    nice -n 19 python3 render.py "$scene.ron" -o "$name" --spp "$spp" --ggx "$ggx" || exit 1
}
one cornell_box cornell_box 4096 mitsuba
one lights lights 4096 mitsuba
one veach_mis_ior_separable veach_mis_ior 8192 mitsuba
one veach_mis_separable veach_mis 8192 separable
one metals_separable metals 4096 mitsuba
one glass_separable glass 4096 mitsuba
one glass_sky_separable glass_sky 4096 mitsuba
one metals_correlated metals 4096 correlated
one glass_correlated glass 4096 correlated
one glass_sky_correlated glass_sky 4096 correlated
one veach_mis_ior_correlated veach_mis_ior 4096 correlated
one veach_mis_correlated veach_mis 4096 correlated
