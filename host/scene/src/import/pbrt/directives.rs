//! Directives of a pbrt file.

use super::parameters::Parameters;
use super::state::TARGETS;
use super::tokens::At;
use super::{CameraDirective, Reader, SceneError, shown};
use glam::DAffine3;
use std::rc::Rc;

impl Reader<'_> {
    /// Reads a directive, whose word was taken.
    pub fn directive(&mut self, word: &str, at: At) -> Result<(), SceneError> {
        if self.transform(word, at)? || self.scope(word, at)? {
            return Ok(());
        }
        match word {
            "Include" | "Import" => {
                let name = self.text(word)?;
                let (files, budget) = (&mut *self.assembly.files, &mut self.assembly.budget);
                self.tokens.include(&name, at, files, budget)
            }
            "Option" => {
                let parameters = Parameters::read(&mut self.tokens)?;
                parameters.ignore(&[
                    "seed",
                    "msereferenceimage",
                    "disablepixeljitter",
                    "disablewavelengthjitter",
                ]);
                self.report_unused(&parameters, "Option");
                Ok(())
            }
            "ColorSpace" => {
                let name = self.text(word)?;
                if name != "srgb" {
                    self.unsupported(
                        at,
                        &format!("ColorSpace \"{}\"", shown(&name)),
                        "colours are taken as srgb",
                    );
                }
                Ok(())
            }
            "ActiveTransform" => {
                let which = self.tokens.take()?;
                self.unsupported(at, "ActiveTransform", "motion is ignored");
                match which {
                    Some(_) => Ok(()),
                    None => self.error(at, "ActiveTransform needs StartTime, EndTime or All"),
                }
            }
            "TransformTimes" => {
                self.numbers::<2>(word)?;
                self.unsupported(at, word, "motion is ignored");
                Ok(())
            }
            "MediumInterface" => self.medium_interface(),
            "NamedMaterial" => self.named_material(at),
            "Material" | "MakeNamedMaterial" | "Texture" | "Shape" | "LightSource" | "AreaLightSource"
            | "MakeNamedMedium" | "Attribute" | "Camera" | "Film" | "Sampler" | "Integrator"
            | "PixelFilter" | "Accelerator" => self.with_parameters(word, at),
            _ => {
                let message =
                    format!("unknown directive \"{}\"; this must be a scene of pbrt-v4", shown(word));
                self.error(at, message)
            }
        }
    }

    /// Reads a directive that begins or ends something; `false` for another one.
    fn scope(&mut self, word: &str, at: At) -> Result<bool, SceneError> {
        match word {
            "AttributeBegin" => self.save("AttributeBegin", at)?,
            "AttributeEnd" => self.restore("AttributeBegin", at)?,
            "TransformBegin" => self.save("TransformBegin", at)?,
            "TransformEnd" => self.restore("TransformBegin", at)?,
            "ReverseOrientation" => self.state.is_reversed = !self.state.is_reversed,
            "WorldBegin" => {
                if self.has_world {
                    return self.error(at, "WorldBegin occurs twice");
                }
                self.begin_world(at)?;
                self.has_world = true;
                self.state.map = DAffine3::IDENTITY;
                self.systems.insert("world".to_owned(), DAffine3::IDENTITY);
            }
            "WorldEnd" => {}
            "ObjectBegin" => {
                let name = self.text(word)?;
                if self.object.is_some() {
                    return self
                        .error(at, "objects cannot contain objects; ObjectEnd must stand before this");
                }
                if self.objects.contains_key(&name) {
                    return self.error(at, format!("the object \"{}\" is defined twice", shown(&name)));
                }
                self.save("ObjectBegin", at)?;
                self.object = Some((name, Vec::new()));
            }
            "ObjectEnd" => {
                self.restore("ObjectBegin", at)?;
                self.objects.extend(self.object.take());
            }
            "ObjectInstance" => self.instance(at)?,
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Places the parts of an object.
    fn instance(&mut self, at: At) -> Result<(), SceneError> {
        let name = self.text("ObjectInstance")?;
        if self.object.is_some() {
            return self.error(at, "objects cannot contain objects; ObjectEnd must stand before this");
        }
        let Some(items) = self.objects.get(&name) else {
            return self
                .error(at, format!("unknown object \"{}\"; ObjectBegin must define it", shown(&name)));
        };
        let site = self.tokens.site(at, "ObjectInstance");
        for item in items {
            let mut placed = item.clone();
            placed.transform = self.state.map * item.transform;
            self.assembly.place(&placed, &site)?;
        }
        Ok(())
    }

    /// Reads a directive with a type or a name, and parameters.
    fn with_parameters(&mut self, word: &str, at: At) -> Result<(), SceneError> {
        let kind = self.text(word)?;
        if word == "Texture" {
            let (values, class) = (self.text(word)?, self.text(word)?);
            let parameters = self.parameters(4)?;
            return self.texture(kind, (&values, &class), &parameters, at);
        }
        let needs_world =
            matches!(word, "Shape" | "LightSource" | "AreaLightSource" | "Material" | "MakeNamedMaterial");
        if needs_world != self.has_world && !matches!(word, "MakeNamedMedium" | "Attribute") {
            let place = if needs_world { "after" } else { "before" };
            return self.error(at, format!("{word} must stand {place} WorldBegin"));
        }
        match word {
            "Shape" => {
                let parameters = self.parameters(0)?;
                self.shape(&kind, &parameters, at)
            }
            "LightSource" => {
                let parameters = self.parameters(1)?;
                self.light_source(&kind, &parameters, at)
            }
            "AreaLightSource" => {
                let parameters = self.parameters(1)?;
                self.area_light(&kind, &parameters, at)
            }
            "Material" => {
                let parameters = self.parameters(2)?;
                self.state.material = self.add_base_material(&kind, &kind, &parameters, at)?;
                Ok(())
            }
            "MakeNamedMaterial" => {
                let parameters = self.parameters(2)?;
                self.make_named_material(kind, &parameters, at)
            }
            "MakeNamedMedium" => {
                let parameters = self.parameters(3)?;
                self.make_named_medium(kind, &parameters, at)
            }
            "Attribute" => {
                let parameters = Parameters::read(&mut self.tokens)?;
                let Some(target) = TARGETS.iter().position(|target| *target == kind) else {
                    let message = format!("\"{}\" must be one of {}", shown(&kind), TARGETS.join(", "));
                    return self.error(at, message);
                };
                let merged = Rc::make_mut(&mut self.state.defaults[target]);
                merged.override_by(parameters);
                let bytes = 256 * merged.len() as u64;
                self.assembly.budget.take(bytes, &self.tokens.site(at, word))
            }
            "Camera" => {
                let parameters = Parameters::read(&mut self.tokens)?;
                let to_world = self.state.map.inverse();
                if !to_world.is_finite() {
                    return self.error(at, "the transform of the camera flattens it");
                }
                self.systems.insert("camera".to_owned(), to_world);
                self.assembly.scene.atmosphere = self.medium(&self.state.outside.clone(), at)?;
                self.camera = Some(CameraDirective { kind, parameters, to_world, at });
                Ok(())
            }
            _ => {
                let parameters = Parameters::read(&mut self.tokens)?;
                self.image_setting(word, &kind, &parameters, at)
            }
        }
    }

    /// Reads parameters, and adds those that `Attribute` has set for them.
    fn parameters(&mut self, target: usize) -> Result<Parameters, SceneError> {
        let mut parameters = Parameters::read(&mut self.tokens)?;
        parameters.extend_by(&self.state.defaults[target]);
        Ok(parameters)
    }
}
