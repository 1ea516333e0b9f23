"""GGX conductor and dielectric boundary for Mitsuba, with what Mitsuba's own lack: the height-correlated Smith term and
Schlick's approximation. Definitions: Walter et al. 2007 (D, the boundary), Heitz 2014 (G, visible normals)."""
import drjit as dr
import mitsuba as mi


class Ggx:
    """Isotropic GGX distribution; w and m are in the shading frame, w.z > 0."""

    def __init__(self, alpha, correlated):
        self.a2, self.correlated = alpha * alpha, correlated
        self.alpha = alpha

    def d(self, m):
        t = (m.x * m.x + m.y * m.y) / self.a2 + m.z * m.z
        return dr.select(m.z > 0, 1 / (dr.pi * self.a2 * t * t), 0)

    def lam(self, w):
        t2 = (w.x * w.x + w.y * w.y) / (w.z * w.z)
        return 0.5 * (dr.sqrt(1 + self.a2 * t2) - 1)  # by t2, so for w.z < 0, too

    def g1(self, w):
        return 1 / (1 + self.lam(w))

    def g2(self, wi, wo):
        return 1 / (1 + self.lam(wi) + self.lam(wo)) if self.correlated else self.g1(wi) * self.g1(wo)

    def sample(self, wi, u):
        h = dr.normalize(mi.Vector3f(self.alpha * wi.x, self.alpha * wi.y, wi.z))
        phi = 2 * dr.pi * u.x
        z = dr.fma(1 - u.y, 1 + h.z, -h.z)  # Dupuy and Benyoub 2023: a spherical cap
        r = dr.sqrt(dr.clip(1 - z * z, 0, 1))
        c = mi.Vector3f(r * dr.cos(phi), r * dr.sin(phi), z) + h
        return dr.normalize(mi.Vector3f(self.alpha * c.x, self.alpha * c.y, dr.maximum(c.z, 1e-7)))

    def pdf(self, wi, m):
        return self.g1(wi) * dr.maximum(dr.dot(wi, m), 0) * self.d(m) / wi.z


class Conductor(mi.BSDF):
    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.alpha = props.get("alpha", 0.1)
        self.correlated = bool(props.get("correlated", True))
        color = lambda name: mi.Color3f(*[props.get(f"{name}_{c}", 1.0) for c in "rgb"])
        self.schlick = bool(props.get("schlick", False))
        self.eta, self.k, self.r0 = color("eta"), color("k"), color("r0")
        self.m_flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [self.m_flags]

    def fresnel(self, c):
        if self.schlick:
            return self.r0 + (1 - self.r0) * (1 - c) ** 5
        # Born and Wolf: complex index n + ik from vacuum.
        s2 = 1 - c * c
        p = self.eta * self.eta - self.k * self.k - s2
        q = dr.sqrt(p * p + 4 * self.eta * self.eta * self.k * self.k)
        a = dr.sqrt(dr.maximum(0.5 * (q + p), 0))
        rs = (q + c * c - 2 * a * c) / (q + c * c + 2 * a * c)
        rp = rs * (q * c * c + s2 * s2 - 2 * a * c * s2) / (q * c * c + s2 * s2 + 2 * a * c * s2)
        return 0.5 * (rs + rp)

    def sides(self, si, wo):
        flip = dr.sign(si.wi.z)
        wi = mi.Vector3f(si.wi.x, si.wi.y, si.wi.z * flip)
        return wi, mi.Vector3f(wo.x, wo.y, wo.z * flip)

    def eval_pdf(self, ctx, si, wo, active=True):
        wi, wo = self.sides(si, wo)
        ggx = Ggx(self.alpha, self.correlated)
        m = dr.normalize(wi + wo)
        active = active & (wi.z > 0) & (wo.z > 0)
        value = self.fresnel(dr.clip(dr.dot(wi, m), 0, 1)) * ggx.d(m) * ggx.g2(wi, wo) / (4 * wi.z)
        pdf = ggx.pdf(wi, m) / (4 * dr.dot(wi, m))
        return dr.select(active, value, 0), dr.select(active, pdf, 0)

    def eval(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[1]

    def sample(self, ctx, si, sample1, sample2, active=True):
        wi, _ = self.sides(si, si.wi)
        ggx = Ggx(self.alpha, self.correlated)
        m = ggx.sample(wi, sample2)
        wo = 2 * dr.dot(wi, m) * m - wi
        flip = dr.sign(si.wi.z)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = mi.Vector3f(wo.x, wo.y, wo.z * flip)
        bs.eta = 1.0
        bs.sampled_component = mi.UInt32(0)
        bs.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        value, bs.pdf = self.eval_pdf(ctx, si, bs.wo, active)
        valid = active & (wo.z > 0) & (wi.z > 0) & (bs.pdf > 0)
        return bs, dr.select(valid, value / bs.pdf, 0)

    def to_string(self):
        return "Conductor"


class Dielectric(mi.BSDF):
    """Rough dielectric boundary of Walter et al. 2007, section 5; with `correlated`, G is 1 / (1 + lam(wi) + lam(wo)) for both lobes, as in pbrt-v4."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.alpha = props.get("alpha", 0.1)
        self.ior = props.get("ior", 1.5)
        self.correlated = bool(props.get("correlated", True))
        both = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [mi.BSDFFlags.GlossyReflection | both, mi.BSDFFlags.GlossyTransmission | both | mi.BSDFFlags.NonSymmetric]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def sides(self, si, wo):
        flip = dr.sign(si.wi.z)
        eta = dr.select(si.wi.z > 0, self.ior, 1 / self.ior)  # far side over near side
        return mi.Vector3f(si.wi.x, si.wi.y, si.wi.z * flip), mi.Vector3f(wo.x, wo.y, wo.z * flip), flip, eta

    def eval_pdf(self, ctx, si, wo, active=True):
        wi, wo, _, eta = self.sides(si, wo)
        ggx = Ggx(self.alpha, self.correlated)
        reflect = wo.z > 0
        m = dr.normalize(wi + wo * dr.select(reflect, 1, eta))
        m = dr.select(m.z < 0, -m, m)
        im, om = dr.dot(wi, m), dr.dot(wo, m)
        active = active & (wi.z > 0) & (wo.z != 0) & (im > 0) & (reflect == (om > 0))
        f = mi.fresnel(im, eta)[0]
        common = ggx.d(m) * ggx.g2(wi, wo) / wi.z
        jacobian = eta * eta * dr.abs(om) / dr.square(im + eta * om)
        # Radiance is compressed by 1 / eta² on the way into the denser side.
        value = dr.select(reflect, f * common / 4, (1 - f) * common * im * jacobian / (eta * eta))
        pdf = ggx.pdf(wi, m) * dr.select(reflect, f / (4 * im), (1 - f) * jacobian)
        return mi.Color3f(dr.select(active, value, 0)), dr.select(active, pdf, 0)

    def eval(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[1]

    def sample(self, ctx, si, sample1, sample2, active=True):
        wi, _, flip, eta = self.sides(si, si.wi)
        m = Ggx(self.alpha, self.correlated).sample(wi, sample2)
        im = dr.dot(wi, m)
        f, cos_t, _, inverse = mi.fresnel(im, eta)
        reflect = sample1 <= f
        wo = dr.select(reflect, 2 * im * m - wi, m * (im * inverse + cos_t) - wi * inverse)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = mi.Vector3f(wo.x, wo.y, wo.z * flip)
        bs.eta = dr.select(reflect, 1, eta)
        bs.sampled_component = dr.select(reflect, mi.UInt32(0), mi.UInt32(1))
        bs.sampled_type = dr.select(reflect, mi.UInt32(+mi.BSDFFlags.GlossyReflection), mi.UInt32(+mi.BSDFFlags.GlossyTransmission))
        value, bs.pdf = self.eval_pdf(ctx, si, bs.wo, active)
        valid = active & (reflect == (wo.z > 0)) & (bs.pdf > 0)
        return bs, dr.select(valid, value / bs.pdf, 0)

    def to_string(self):
        return "Dielectric"


def register():
    mi.register_bsdf("trisect_dielectric", lambda props: Dielectric(props))
    mi.register_bsdf("trisect_conductor", lambda props: Conductor(props))
