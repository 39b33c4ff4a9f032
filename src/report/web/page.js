const box=document.querySelector('.compare');
if(box){
 const under=box.querySelector('.under'),over=box.querySelector('.over'),right=box.querySelector('.r');
 const views=[...document.querySelectorAll('button.view')],layers=[...document.querySelectorAll('button.layer')];
 let view=views[0],layer='T';
 const wanted=()=>layer!='T'?[layer,'photo']:view.dataset.flash=='1'?['T_F','T_N','photo']:['T_N','T_F','photo'];
 const key=()=>{const has=view.dataset.has.split(' ');return wanted().find(k=>has.includes(k))};
 const show=()=>{
  over.src=view.dataset.base+'photo.jpg';under.src=view.dataset.base+key()+'.jpg';
  right.textContent=(layers.find(b=>b.dataset.layer==layer)||{}).textContent||'';
  views.forEach(b=>b.setAttribute('aria-pressed',b==view));
  layers.forEach(b=>b.setAttribute('aria-pressed',b.dataset.layer==layer));
  document.querySelectorAll('.grid.of-view').forEach(g=>g.hidden=g.dataset.base!=view.dataset.base);
 };
 views.forEach(b=>b.onclick=()=>{view=b;show()});
 layers.forEach(b=>b.onclick=()=>{layer=b.dataset.layer;show()});
 box.querySelector('input').oninput=e=>box.style.setProperty('--at',e.target.value+'%');
 show();
}
