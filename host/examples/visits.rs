use trisect::{scene::Scene,bvh::Bvh};
use trisect_shared::{bvh::*,rng::*,math::*,sphere::*,ray::Departure};
use glam::Vec3;
fn area(a:Vec3,b:Vec3)->f32{let e=b-a; e.x*e.y+e.y*e.z+e.z*e.x}
fn sweep(s:&[Sphere])->Vec<BvhNode>{
  fn bb(s:&[Sphere],ix:&[usize])->(Vec3,Vec3){ix.iter().fold((Vec3::splat(1e30),Vec3::splat(-1e30)),|(a,b),&i|(a.min(s[i].center-s[i].radius),b.max(s[i].center+s[i].radius)))}
  fn rec(s:&[Sphere],ix:&mut [usize],n:&mut Vec<BvhNode>)->u32{
    if ix.len()==1 {return 0x8000_0000|ix[0] as u32;}
    let mut best=(f32::MAX,0,0);
    for ax in 0..3 { ix.sort_by(|&a,&b|s[a].center[ax].total_cmp(&s[b].center[ax])); let m=ix.len(); let mut ra=vec![0f32;m]; let (mut lo,mut hi)=(Vec3::splat(1e30),Vec3::splat(-1e30)); for k in (1..m).rev(){let i=ix[k];lo=lo.min(s[i].center-s[i].radius);hi=hi.max(s[i].center+s[i].radius);ra[k]=area(lo,hi);} let (mut lo,mut hi)=(Vec3::splat(1e30),Vec3::splat(-1e30)); for k in 1..m{let i=ix[k-1];lo=lo.min(s[i].center-s[i].radius);hi=hi.max(s[i].center+s[i].radius);let c=area(lo,hi)*k as f32+ra[k]*(m-k) as f32; if c<best.0{best=(c,ax,k);}} }
    let ax=best.1; ix.sort_by(|&a,&b|s[a].center[ax].total_cmp(&s[b].center[ax]));
    let me=n.len(); n.push(bytemuck::Zeroable::zeroed()); let (l,r)=ix.split_at_mut(best.2); let (lb,rb)=(bb(s,l),bb(s,r)); let a=rec(s,l,n); let b=rec(s,r,n);
    n[me]=BvhNode{first_min:lb.0,first:a,first_max:lb.1,second:b,second_min:rb.0,pad0:0,second_max:rb.1,pad1:0}; me as u32 }
  let mut ix:Vec<usize>=(0..s.len()).collect(); let mut n=vec![]; rec(s,&mut ix,&mut n); n
}
fn bx(o:Vec3,i:Vec3,a:Vec3,b:Vec3,m:f32)->(bool,f32){let t0=(a-o)*i;let t1=(b-o)*i; let e=t0.min(t1).max_element().max(0.0); let x=t0.max(t1).min_element().min(m); (e<=x,e)}
fn count(s:&[Sphere],n:&[BvhNode],cull:bool)->(f64,f64,f64){
  let (mut nv,mut lv,mut rays)=(0u64,0u64,0u64);
  for i in 0..60000u32 { let w=PathKey{seed:0,pixel:i,sample:0}.words(0);
    let mut o=Vec3::new(13.,2.,3.); let tgt=Vec3::new(-8.+16.*unit_f32(w.x),unit_f32(w.y)*1.0,-8.+16.*unit_f32(w.z)); let mut d=normalize(tgt-o); let mut dep=Departure::NONE;
    for seg in 0..3 { rays+=1;
      let inv=Vec3::ONE/d; let mut st:Vec<(u32,f32)>=vec![]; let mut c=0u32; let mut best=MISS; let mut hit=u32::MAX; 
      loop { let mut pop=true; if c>>31!=0 { lv+=1; let p=c&0x7fffffff; let t=s[p as usize].distance(o,d,dep.is_on(p),dep); if t<best {best=t;hit=p;} }
        else { nv+=1; let k=&n[c as usize]; let (a,ta)=bx(o,inv,k.first_min,k.first_max,best); let (b,tb)=bx(o,inv,k.second_min,k.second_max,best);
          if a||b { let bn=b&&(!a||tb<ta); c=if bn {k.second} else {k.first}; if a&&b {st.push(if bn {(k.first,ta)} else {(k.second,tb)});} pop=false; } }
        if pop { let mut done=true; while let Some((x,t))=st.pop() { if cull && t>best {continue;} c=x; done=false; break; } if done {break;} } }
      if hit==u32::MAX {break;}
      let (nn,p)=s[hit as usize].project(o+d*best); let w=PathKey{seed:0,pixel:i,sample:0}.words(seg+1); d=normalize(nn+unit_sphere(w.x,w.y)); o=p; dep=Departure::from(hit,false);
    } }
  (nv as f64/rays as f64,lv as f64/rays as f64,rays as f64/60000.)
}
fn main(){ let sc=Scene::load(std::path::Path::new("scenes/rtiow_final.ron")).unwrap(); let b=Bvh::build(&sc).unwrap(); let sw=sweep(&sc.spheres);
 println!("obvhs depth {} {:?} cull {:?}",b.depth,count(&sc.spheres,&b.nodes,false),count(&sc.spheres,&b.nodes,true)); println!("sweep {:?} cull {:?}",count(&sc.spheres,&sw,false),count(&sc.spheres,&sw,true)); }
